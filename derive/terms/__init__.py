"""Named shared terms of a derivation."""
