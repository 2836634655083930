"""Named shared terms; vectors, derivatives and functions of named terms; Lie groups."""
