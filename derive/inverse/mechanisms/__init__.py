"""Inverses of robots with loops: by the main chain, a shortened chain, or the legs."""
