"""Loops without a closed form: equations for Newton's iteration, and the functions of q."""
