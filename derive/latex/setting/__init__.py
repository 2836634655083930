"""Typesetting of names, symbols and displayed equations in LaTeX."""
