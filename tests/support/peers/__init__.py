"""Peers that solve the inverse kinematics: all solutions in closed form, or one by iteration."""
