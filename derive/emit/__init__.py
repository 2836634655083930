"""What is written of a derivation: C, CasADi, Python and the manifest."""
