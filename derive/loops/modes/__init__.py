"""Platforms on legs: velocity relations and all assembly modes."""
