"""Least squares: the variables, which of them measurements tell apart, and the iteration."""
