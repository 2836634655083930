"""Tolerances of studies: name, value, unit and reason."""

# --- motion ---

ON_CURVE = 1e-11
"""Maximum residual [m, rad] of a configuration on a curve: a hundredth of the documented
accuracy of motions."""
IN_PLACE = 1e-12
"""Distance [m] and angle [rad] between two poses that count as rounding errors. If the poses are
more than 1 m away from the base, their distance is divided by the distance from the base."""
STRAIGHT = 1e-9
"""Three points count as collinear if the sine of the angle between their two connecting lines is
smaller. The radius of the circle through them is then a billion times their distance. This sine is
also the relative distance up to which points count as
coplanar."""
NODES_APART = 2e-3
"""Node spacing of fourth-order finite differences, relative to the curve length. The truncation
error relative to higher derivatives is the fourth power of the spacing, 2e-11. Second derivatives
amplify rounding errors to about 2e-10."""

# --- planar regions bounded by arcs ---

SAME_ARC = 1e-11
"""Up to this distance (relative to the size of a region), circles are equal and short arcs count as
points. The value is far above rounding errors and far below manufacturing tolerances."""
TANGENT = 1e-12
"""Circles count as tangent if a cosine differs from 1 by less than this value, a thousand times the
rounding error."""
TEST_DISTANCE = 3e-11
"""Distance of the test points on both sides of an arc, relative to the size of the region; smaller
for short arcs. The distance exceeds SAME_ARC, so the test point lies outside all arcs that count as
equal."""

# --- static loads ---

STATICALLY_SINGULAR = 1e-9
"""Up to this relative size, a singular value of the equilibrium equations, an unbalanced force or
the sine of an angle between axes counts as 0. Poses of closed loops have errors up to 1e-12."""
