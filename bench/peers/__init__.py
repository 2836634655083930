"""Interfaces to other libraries for the same kinematics."""
