"""Loops with variable geometry: parameters, equations and the functions of q and p."""
