"""Kinematics of a chain of joints: its groups, poses, Jacobians and their derivatives."""
