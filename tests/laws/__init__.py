"""Identities of SO(3) and SE(3) agree with series, 40-digit arithmetic and Pinocchio."""
