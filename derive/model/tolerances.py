"""Every tolerance of the compiler: name, value, unit and reason, by the room that uses it.

Lengths are told in parts of the robot's characteristic length where nothing else is said. A number
that a formula needs for other reasons (a count of steps, a size of a page) is no tolerance and
stays where it is used.
"""

# --- description: what a file rounds ---

# --- terms, chain: numbers that are integers ---

UNIT_VECTOR = 1e-12
"""Excess of a vector's squared length over 1 (no unit): a unit vector of a few rounded products of
order 1 is off by about 1e-15. A vector of exact numbers must be of length 1 exactly."""

# --- loops: closures, ranks, branches ---

# --- inverse: structures, boundaries of subproblems, eigenvalues ---

# --- latex: what a reader need not see ---
