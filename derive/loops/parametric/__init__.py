"""Loops whose geometry is an input: parameters, equations and the functions of q and p."""
