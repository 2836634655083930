"""Converts programs to single precision and measures their errors."""
