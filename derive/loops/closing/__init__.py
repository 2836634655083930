"""Closes loops numerically from the reference.

The package also computes the mobility, checks the actuation, and diagnoses open loops.
"""
