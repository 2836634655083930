"""Spatial loops that have a closed form: legs on balls."""
