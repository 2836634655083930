"""Every tolerance of the compiler: name, value, unit and reason, by the room that uses it.

Lengths are told in parts of the robot's characteristic length where nothing else is said. A number
that a formula needs for other reasons (a count of steps, a size of a page) is no tolerance and
stays where it is used.
"""

# --- every room: numbers to many digits ---

EVALUATION_DIGITS = 40
"""Decimal digits to which constants are evaluated: more than twice those of the doubles in the C,
so that what a comparison decides is not decided by rounding."""
RELIABLE_DIGITS = EVALUATION_DIGITS - 8
"""Decimal digits of such a constant that are taken to be right: eight are left to the rounding of
the operations that it is made of and to cancellation between them."""
ROUNDING = 10.0**-RELIABLE_DIGITS
"""Difference (no unit) below which a constant of order 1 is the same as an integer: 1e-32."""

# --- description: what a file rounds ---

ANGLE_SNAP = 1e-9
"""Difference (radian) within which an angle of a URDF is taken for a multiple of pi/12: exporters
round to ten digits or more, and 1e-9 of a radian moves a tool at 1 m by 1 nm."""
LENGTH_SCALING = 1e-10
"""Departure (m or rad, at lengths of about 1 m) from linear or from constant growth above which an
expression does not scale with the file's lengths: evaluated to 15 digits, one that scales is off by
about 1e-14, and one that does not by its own size."""

# --- terms, chain: numbers that are integers ---

MEANT = 1e-100
"""Magnitude (no unit) below which a constant other than 0 keeps its value: rounding leaves no less
than about 1e-40 of numbers of order 1, so a file that gives 1e-150 means it."""
UNIT_VECTOR = 1e-12
"""Excess of a vector's squared length over 1 (no unit): a unit vector of a few rounded products of
order 1 is off by about 1e-15. A vector of exact numbers must be of length 1 exactly."""

# --- loops: closures, ranks, branches ---

# --- inverse: structures, boundaries of subproblems, eigenvalues ---

# --- latex: what a reader need not see ---

PRINTED_DIGITS = 10
"""Digits of a number without a short exact form in an article; dots follow where digits are cut."""
FEW_PRINTED_DIGITS = 6
"""The same where a line has no room for more."""
