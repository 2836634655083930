"""Every tolerance of the compiler: name, value, unit and reason, by the room that uses it.

Lengths are told in parts of the robot's characteristic length where nothing else is said. A number
that a formula needs for other reasons (a count of steps, a size of a page) is no tolerance and
stays where it is used.
"""

# --- description: what a file rounds ---

# --- terms, chain: numbers that are integers ---

# --- loops: closures, ranks, branches ---

BRANCHES_APART = 1e-6
"""Two branches whose distances from the reference differ by less are not told apart.

Root of a sum of squared radians and metres. The distances come from doubles through a few roots,
which leaves about 1e-8 near a dead point; a reference is given by hand, to millimetres.
"""
ZERO_COMPONENT = 1e-25
"""Components of vectors below this are zero (pure number, or metre where points are compared).

They are computed to 40 digits: 15 of them remain for rounding, and nothing that a description means
to be different from zero is as small.
"""
CLOSED_LOOP = 1e-12
"""Residual below which a loop is closed in double precision (metre, or sine of an angle)."""
ZERO_SINGULAR_VALUE = 1e-9
"""Singular values below this part of the largest are zero (pure number).

Far above the rounding of a Jacobian at a closed configuration (1e-15), far below the smallest
singular value away from singularities (1e-3).
"""
REPEATED_EQUATION = 1e-4
"""Singular values of equations that repeat others near closure, as parts of the largest.

A residual of 1e-12 may be 1e-6 away from closure there, and such equations still look independent.
"""
WORTHWHILE_STEP = 0.9
"""A step of Newton's method that leaves more than this part of the residual is shortened."""
SAMPLED_RANGE = 0.3
"""Distance of random configurations from the reference: radian, and part of the mechanism's size.

Large enough to leave a singular reference, small enough for Newton's method to close the loops.
"""
SAME_POINT = 1e-9
"""Points of a drawing closer than this are one (metre), and so are directions (pure number).

Closed loops in doubles leave 1e-12; the eye sees no less than 1e-4 of a robot's size.
"""
VISIBLE_GAP = 2e-3
"""A drawn loop may stand open by this part of the robot's size: the eye sees no gap below it."""
SAME_VIEW = 1e-6
"""Directions of a solved configuration are parallel to this angle in a drawing (radian).

A configuration that closes overconstrained loops is known to about 1e-7.
"""
LAYOUT_TIE = 1e-5
"""Numbers this close to the middle between two tenths of a millimetre are rounded up (0.1 mm).

Machines differ in the last digits of these numbers; the bytes of a drawing must not.
"""

# --- inverse: structures, boundaries of subproblems, eigenvalues ---

# --- latex: what a reader need not see ---

# --- emit: tolerances that the runtime reads from the manifest ---

DEAD_POINT = 1e-12
"""Margin, a pure number, up to which a loop counts as at its dead point: sin^2 of a millionth of a
radian."""
NOMINAL = 0.05
"""Residual (metre, radian) of a nominal arm up to which the true arm might reach the pose: axes
that were snapped differ by millimetres, and a long arm multiplies angles."""
