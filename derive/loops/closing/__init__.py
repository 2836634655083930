"""Closes loops numerically from the reference.

Also computes the mobility, checks the actuation, and diagnoses open loops.
"""
