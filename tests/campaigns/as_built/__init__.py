"""``python -m bench robust``: mutated files and arms of round numbers, each read and derived."""
