"""Loops without a closed form: their equations for Newton's iteration, and the functions of q."""
