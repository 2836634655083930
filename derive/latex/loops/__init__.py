"""LaTeX fragments for robots with loops: closures, mobility, solution, rates, platforms."""
