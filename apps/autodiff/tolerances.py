"""Numerical tolerances of the functions with automatic differentiation."""

SOLVED = {"float64": 1e-9, "float32": 2e-5}
"""Largest residual of a solution [m or rad], for each float type. In single precision, the target
pose itself is rounded."""
MAX_INVERSE = {"float64": 1e6, "float32": 1e3}
"""Largest entry of an inverse Jacobian [rad or m, per rad or m], for each float type. At a singular
configuration, the joint error is about the square root of the rounding error. The smallest singular
value of the Jacobian is then about 1e-8 (float64) or 3e-4 (float32) instead of 0."""
