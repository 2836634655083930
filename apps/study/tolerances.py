"""Tolerances of the studies, with their units and reasons."""

# --- motion ---

ON_CURVE = 1e-11
"""Maximum residual [m, rad] of a configuration on a curve."""
IN_PLACE = 1e-12
"""Two poses count as equal if the distance [m] and the angle [rad] between them are at most this
value. If a pose is farther than 1 m from the base, the distance between the poses is divided by the
distance from the base."""
STRAIGHT = 1e-9
"""Three points count as collinear if the sine of the angle between their connecting lines is at
most 1e-9. Points count as coplanar if their distance from a plane is at most 1e-9 of their extent.
"""
NODES_APART = 2e-3
"""Node spacing of fourth-order finite differences, relative to the curve length. The relative
truncation error is about the fourth power of the spacing, 2e-11. Second derivatives amplify
rounding errors to about 2e-10."""

# --- planar regions bounded by arcs ---

SAME_ARC = 1e-11
"""Two circles count as equal if the difference of their centers and radii is at most this value. An
arc counts as a point if its length is at most this value."""
TANGENT = 1e-12
"""Two circles count as tangent if cos(a) differs from 1 by less than 1e-12, where a is the angle
between the line of centers and the radius to an intersection. This tolerance is a thousand times
the rounding error of a cosine."""
TEST_DISTANCE = 3e-11
"""Distance of the test points on both sides of an arc, relative to the size of the region. The
distance exceeds SAME_ARC, so a test point cannot lie on another arc that counts as equal to this
arc."""

# --- static loads ---

STATICALLY_SINGULAR = 1e-9
"""Relative tolerance below which a value counts as 0. The tolerance applies to singular values of
the equilibrium equations, unbalanced forces and sines of angles between axes."""
