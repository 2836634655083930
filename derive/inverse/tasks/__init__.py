"""Inverse-kinematics tasks, with their generated functions."""
