"""Solvers by iteration: inverse kinematics of any robot, and loops without a closed form."""
