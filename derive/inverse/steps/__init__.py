"""Closed-form solution steps that several arm families share, and the record of these steps."""
