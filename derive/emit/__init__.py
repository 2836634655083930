"""Writes the files of a derivation, which are C, CasADi, Python and the manifest."""
