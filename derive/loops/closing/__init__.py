"""Loops closed in numbers: reference configuration, mobility, actuation, and diagnosis of gaps."""
