"""Planar loops in closed form: triangles, parallelograms and sliders."""
