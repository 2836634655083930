"""Converts the expression graphs of functions to single precision and measures their errors."""
