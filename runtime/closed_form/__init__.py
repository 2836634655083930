"""Closed-form inverses: solutions in slots, paths, and refinement."""
