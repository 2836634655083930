"""Typed programs of functions."""
