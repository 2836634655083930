"""The tolerances of studies: name, value, unit and reason."""

# --- motion ---

ON_CURVE = 1e-11
"""Residual (length, radian) up to which iteration is on a curve: a hundredth of the distance from
the curve that motions promise."""
IN_PLACE = 1e-12
"""Way [m] of the tool's origin, or angle [rad], that is rounding of the poses at both ends: the
tool stays or turns in place. Beyond 1 m from the base it is this part of the distance."""
STRAIGHT = 1e-9
"""Sine of an angle below which three points lie on a line: their circle is a million times larger
than their distances. Also the distance, in parts of their size, up to which points lie in a
plane."""
NODES_APART = 2e-3
"""Distance of the nodes of differences along a curve, in parts of its length: differences of fourth
order are off by its fourth power, 2e-11 of the curve's fifth derivative, and rounding is divided by
its square in the second derivative, 2e-10."""

# --- planar: regions bounded by arcs ---

SAME_ARC = 1e-11
"""Distance, in parts of a region's size, up to which circles are the same and pieces of them are
points: far above rounding, far below anything that is built."""
TANGENT = 1e-12
"""Distance of a cosine from 1 below which circles touch: they overlap by this part of a radius, of
which rounding leaves a thousandth."""
BESIDE = 3e-11
"""Distance from an arc, in parts of a region's size, at which its sides are judged; less beside
short pieces. Above SAME_ARC, so that the other side of all arcs that are the same lies there; two
borders that are nearer to each other, but not the same, would be taken for one."""
