"""LaTeX fragment for the inverse: structure of the axes, solution steps, and solution slots."""
