"""Writes a Python module with JAX functions."""
