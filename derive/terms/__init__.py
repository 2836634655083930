"""Named shared terms, vectors, tangents and functions over them, and Lie groups."""
