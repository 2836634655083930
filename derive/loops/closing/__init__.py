"""Numerically closed loops: reference, mobility, actuation, and diagnosis of open loops."""
