"""Every tolerance of the compiler: name, value, unit and reason, by the room that uses it.

Lengths are told in parts of the robot's characteristic length where nothing else is said. A number
that a formula needs for other reasons (a count of steps, a size of a page) is no tolerance and
stays where it is used.
"""

# --- description: what a file rounds ---

# --- terms, chain: numbers that are integers ---

# --- loops: closures, ranks, branches ---

# --- inverse: structures, boundaries of subproblems, eigenvalues ---

# --- latex: what a reader need not see ---

# --- emit: tolerances that the runtime reads from the manifest ---

DEAD_POINT = 1e-12
"""Margin, a pure number, up to which a loop counts as at its dead point: sin^2 of a millionth of a
radian."""
NOMINAL = 0.05
"""Residual (metre, radian) of a nominal arm up to which the true arm might reach the pose: axes
that were snapped differ by millimetres, and a long arm multiplies angles."""
