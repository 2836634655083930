"""Inverse kinematics of robots with loops."""
