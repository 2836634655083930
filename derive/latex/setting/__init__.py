"""Typesetting: names, symbols, widths, and displays that fit the page."""
