"""Relative positions of the axes of a chain, which determine its closed-form inverse."""
