"""Closed-form inverse kinematics: families of axis structures, solution steps and subproblems."""
