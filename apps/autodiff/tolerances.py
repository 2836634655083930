"""Numerical tolerances of the functions with automatic differentiation."""

SOLVED = {"float64": 1e-9, "float32": 2e-5}
"""Largest residual of a solution [m or rad], for each float type. In single precision, the target
pose itself is rounded."""
MAX_INVERSE = {"float64": 1e6, "float32": 1e3}
"""Largest entry of an inverse Jacobian [rad or m, per rad or m], for each float type."""
