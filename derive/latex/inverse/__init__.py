"""The fragment of the inverse: structure, steps, and slots."""
