"""Singular configurations of serial arms: determinant factors and their descriptions."""
