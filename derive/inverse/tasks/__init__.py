"""Tasks of an inverse, with their generated functions."""
