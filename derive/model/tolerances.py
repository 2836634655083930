"""Every tolerance of the compiler: name, value, unit and reason, by the room that uses it.

Lengths are told in parts of the robot's characteristic length where nothing else is said. A number
that a formula needs for other reasons (a count of steps, a size of a page) is no tolerance and
stays where it is used.
"""

# --- every room: numbers to many digits ---

EVALUATION_DIGITS = 40
"""Decimal digits to which constants are evaluated: more than twice the 16 digits of a double, so
that rounding does not decide comparisons with integers and multiples of pi."""
RELIABLE_DIGITS = EVALUATION_DIGITS - 8
"""Decimal digits of such a constant that are correct: rounding of the operations in it and
cancellation between them may spoil the last eight."""
ROUNDING = 10.0**-RELIABLE_DIGITS
"""Difference (no unit) below which a constant of order 1 equals an integer: 1e-32, the last of the
reliable digits."""

# --- description: rounding in files ---

ANGLE_SNAP = 1e-9
"""Difference (radian) within which an angle of a URDF becomes a multiple of pi/12: exporters round
to ten digits or more, and 1e-9 rad moves a tool at 1 m by 1 nm."""
LENGTH_SCALING = 1e-10
"""Deviation (m or rad, at lengths of about 1 m) from a linear or a constant function above which an
expression does not scale with the file's lengths: at 15 digits, rounding gives about 1e-14, and
a wrong expression by about its own value."""

# --- terms, chain: numbers that are integers ---

MEANT = 1e-100
"""Magnitude (no unit) below which a constant other than 0 keeps its value: rounding of numbers of
order 1 leaves no less than about 1e-40, so that a constant of 1e-150 comes from the file itself."""
UNIT_VECTOR = 1e-12
"""Difference of a unit vector's squared length from 1 (no unit): rounding of its components leaves
about 1e-15. A vector of exact numbers must be of length 1 exactly."""

# --- loops: closures, ranks, branches ---

# --- inverse: structures, boundaries of subproblems, eigenvalues ---

# --- latex: digits that are printed ---

PRINTED_DIGITS = 10
"""Digits of a number without a short exact form in an article; dots follow where digits are cut."""
FEW_PRINTED_DIGITS = 6
"""Digits of such a number where a line has no room for ``PRINTED_DIGITS``."""
