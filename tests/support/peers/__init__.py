"""Closed-form and iterative inverse kinematics solvers of other libraries."""
