"""Singular configurations of serial arms."""
