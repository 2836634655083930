"""Relative positions of the joint axes in a chain."""
