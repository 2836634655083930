"""Relative positions of the joint axes in a chain, which determine its closed-form inverse."""
