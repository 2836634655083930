"""Named shared terms, with vectors, derivatives and functions of terms, and Lie groups."""
