"""Subproblems of closed-form inverses, one file per subproblem."""
