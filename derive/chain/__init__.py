"""Kinematics of a serial chain."""
