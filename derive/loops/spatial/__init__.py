"""Closed-form solutions of spatial loops, such as legs with ball joints at their ends."""
