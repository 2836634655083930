"""Planar loops in closed form: sums of rotated vectors, triangles, platforms on rods."""
