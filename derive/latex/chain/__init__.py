"""LaTeX fragments that describe a serial chain."""
