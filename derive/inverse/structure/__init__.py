"""Relative positions of the axes of a chain, which decide the closed form."""
