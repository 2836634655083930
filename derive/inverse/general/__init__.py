"""Inverse kinematics of general arms with five or six free joints."""
