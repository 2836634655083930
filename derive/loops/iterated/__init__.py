"""Loops without a closed form, which are closed by Newton's method."""
