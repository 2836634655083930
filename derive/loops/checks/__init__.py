"""Remarks on a robot whose loops close: limits, dead points and doubtful values."""
