"""Inverses of robots with loops, derived from the main chain, a shortened chain, or the legs."""
