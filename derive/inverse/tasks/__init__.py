"""Tasks of an inverse, and their generated functions over all solutions."""
