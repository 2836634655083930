"""Named shared terms; vectors, derivatives and functions of such terms; Lie groups."""
