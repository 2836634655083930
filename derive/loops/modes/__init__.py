"""Computes the velocity relations and all assembly modes of platforms on legs."""
