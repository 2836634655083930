"""Closed-form inverse kinematics: axis structures, families and subproblems."""
