"""Writes the C, CasADi and Python files of a derivation, and its manifest."""
