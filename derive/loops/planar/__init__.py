"""Planar loops in closed form: points as sums of turning vectors, triangles, platforms on rods."""
