"""Numerically closed loops: reference configuration, mobility, actuation, and diagnosis of gaps."""
