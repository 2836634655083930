"""Writes the files of a derivation: C, CasADi, Python and the manifest."""
