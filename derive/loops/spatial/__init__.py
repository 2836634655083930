"""Loops of space that have a closed form: legs on balls."""
