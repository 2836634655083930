"""Compares identities of SO(3) and SE(3) with series, 40-digit arithmetic and Pinocchio."""
