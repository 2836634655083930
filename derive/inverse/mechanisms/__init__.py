"""Inverses of robots with loops."""
