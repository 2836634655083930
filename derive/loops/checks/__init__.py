"""Numerical checks of a description before its loops are solved."""
