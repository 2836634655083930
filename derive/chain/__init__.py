"""Kinematics of a serial chain: groups of parallel axes, poses, Jacobians, derivatives."""
