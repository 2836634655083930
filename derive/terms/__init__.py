"""Named shared terms, with vectors, tangents and functions over them, and Lie groups."""
