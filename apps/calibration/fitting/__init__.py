"""Least-squares fit: the variables, their identifiability, and the iteration."""
