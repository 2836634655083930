"""Remarks on a robot with loops: limits, dead points and doubtful values."""
