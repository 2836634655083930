"""LaTeX fragments for robots with loops."""
