"""Article fragment for the inverse: structure, steps, and slots."""
