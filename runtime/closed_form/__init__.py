"""Closed-form inverses: solutions in slots, paths, calibrated arms, and refinement."""
