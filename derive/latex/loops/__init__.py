"""Fragments of robots with loops: closures, mobility, solution, rates, platforms."""
