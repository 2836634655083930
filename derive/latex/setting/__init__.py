"""Typesetting: names, symbols, widths, and displays that stay on the page."""
