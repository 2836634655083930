"""Typesetting of names, symbols and displays."""
