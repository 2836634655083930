"""Measurements of the tool: positions, poses, distances, frames of devices, and tables."""
