"""Named shared terms, and what is built of them: vectors, tangents, Lie groups, functions."""
