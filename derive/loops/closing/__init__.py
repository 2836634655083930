"""Closes loops numerically: reference, mobility, actuation, and diagnosis of open loops."""
