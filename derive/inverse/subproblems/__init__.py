"""Subproblems of closed-form inverse kinematics, one file per subproblem."""
