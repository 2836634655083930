"""Closed-form inverses."""
