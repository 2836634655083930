"""Fragments of a chain: what is given, screw axes, link transforms, poses and Jacobians."""
