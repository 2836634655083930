"""Numerical checks of a robot description before its loops are solved."""
