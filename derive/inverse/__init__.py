"""Closed-form inverse kinematics: the axes' structure, its subproblems, its families."""
