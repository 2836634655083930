"""Closed-form inverses: their solutions, paths on one branch, and refinement."""
