"""Singular configurations of serial arms: a determinant in factors, with words for each."""
