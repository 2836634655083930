"""Identities of SO(3) and SE(3), against series, 40-digit arithmetic and Pinocchio."""
