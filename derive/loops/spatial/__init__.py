"""Spatial loops with a closed form: ball-ended legs."""
