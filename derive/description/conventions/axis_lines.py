"""Fits the fields of a convention to a joint axis.

The reference frame has its z axis along the preceding joint axis. In most conventions, the x axis
of the link points along the common normal of both axes. Hayati's convention uses the plane through
the origin that is normal to the preceding axis. In Hayati's convention, the x axis of the link
points to the intersection of the plane with the joint axis.
"""

from collections.abc import Mapping

import mpmath
import sympy as sp

from ...model.convention import AxisLine, Fitted
from ...model.placements import Vector
from ...model.tolerances import AXIS_DIGITS, EVALUATION_DIGITS, ROUNDING, ZERO_COMPONENT


def angle_between(line: AxisLine) -> mpmath.mpf:
    """Return the angle between a joint axis and the preceding axis (radian), from 0 to pi."""
    x, y, z = line.direction
    return mpmath.atan2(mpmath.hypot(x, y), z)


def is_parallel(line: AxisLine) -> bool:
    """Whether the two axes are parallel, up to rounding errors."""
    x, y, _ = line.direction
    return bool(mpmath.hypot(x, y) <= ZERO_COMPONENT)


def distance_between(line: AxisLine) -> mpmath.mpf:
    """Return the distance between the two axes (meter)."""
    return mpmath.hypot(*line.point[:2]) if is_parallel(line) else abs(_of_normal(line)[2])


def common_normal(line: AxisLine) -> Fitted:
    """Compute the rotation, the shift, a and alpha from the common normal of the two axes.

    For parallel axes, the normal through the origin is used. For coinciding axes, the x axis is
    used.
    """
    with mpmath.workdps(EVALUATION_DIGITS):
        if is_parallel(line):
            x, y, _ = line.point
            shift, a = mpmath.mpf(0), mpmath.hypot(x, y)
            turn = mpmath.atan2(y, x) if a > ZERO_COMPONENT else mpmath.mpf(0)
        else:
            turn, shift, a = _of_normal(line)
        values = {"a": length(a), "alpha": angle(angle_between(line))}
        return Fitted(angle(turn), length(shift), values)


def _of_normal(line: AxisLine) -> tuple[mpmath.mpf, mpmath.mpf, mpmath.mpf]:
    """Return the angle, the shift and the length of the common normal.

    The angle is about the z axis of the reference frame, and the shift is along this axis.
    """
    (x, y, z), (p_x, p_y, p_z) = line.direction, line.point
    sine = mpmath.hypot(x, y)
    n_x, n_y = -y / sine, x / sine
    along = (p_x * x + p_y * y) / sine**2
    return mpmath.atan2(n_y, n_x), p_z - along * z, p_x * n_x + p_y * n_y


def tilts(line: AxisLine) -> Fitted | None:
    """Fit a rotation and the fields a, alpha and beta to a joint axis.

    The fields define the transform Tx(a) Rx(alpha) Ry(beta). The result is None if the two axes are
    perpendicular.
    """
    with mpmath.workdps(EVALUATION_DIGITS):
        (x, y, z), (p_x, p_y, p_z) = line.direction, line.point
        if abs(z) <= ZERO_COMPONENT:
            return None
        p_x, p_y = p_x - p_z / z * x, p_y - p_z / z * y
        a = mpmath.hypot(p_x, p_y)
        turn = mpmath.atan2(p_y, p_x) if a > ZERO_COMPONENT else mpmath.mpf(0)
        c, s = mpmath.cos(turn), mpmath.sin(turn)
        x, y = c * x + s * y, c * y - s * x
        values = {
            "a": length(a),
            "alpha": angle(mpmath.atan2(-y, z)),
            "beta": angle(mpmath.atan2(x, mpmath.hypot(y, z))),
        }
        return Fitted(angle(turn), sp.S.Zero, values)


def origin_and_turns(line: AxisLine) -> tuple[Vector, sp.Expr, sp.Expr]:
    """Return a tuple (point, beta, alpha) for an axis with the direction Ry(beta) Rx(alpha) z."""
    with mpmath.workdps(EVALUATION_DIGITS):
        x, y, z = line.direction
        p_x, p_y, p_z = (length(component) for component in line.point)
        beta, alpha = mpmath.atan2(x, z), mpmath.atan2(-y, mpmath.hypot(x, z))
        return (p_x, p_y, p_z), angle(beta), angle(alpha)


def in_turned_frame(line: AxisLine) -> Vector:
    """Return the axis point in a frame that is rotated by Ry(beta) Rx(alpha)."""
    with mpmath.workdps(EVALUATION_DIGITS):
        (x, y, z), p = line.direction, line.point
        in_plane = mpmath.hypot(x, z)
        c, s = (z / in_plane, x / in_plane) if in_plane > ZERO_COMPONENT else (1, 0)
        across, along = c * p[0] - s * p[2], s * p[0] + c * p[2]
        return (
            length(across),
            length(in_plane * p[1] - y * along),
            length(y * p[1] + in_plane * along),
        )


def fitted(values: Mapping[str, sp.Expr | Vector]) -> Fitted:
    """Return a fit with these field values.

    The rotation and the shift at the previous axis are zero.
    """
    return Fitted(sp.S.Zero, sp.S.Zero, values)


def into_fields(found: Fitted) -> Fitted:
    """Store the rotation about the joint axis in field theta, and the shift along it in field d."""
    return fitted({"theta": found.turn, "d": found.shift, **found.values})


def angle(value: mpmath.mpf) -> sp.Expr:
    """Return an angle (radian) as a multiple of pi/12, or as a rounded decimal."""
    twelfths = 12 * value / mpmath.pi
    nearest = int(mpmath.nint(twelfths))
    return sp.pi * nearest / 12 if abs(twelfths - nearest) < ROUNDING else length(value)


def length(value: mpmath.mpf) -> sp.Expr:
    """Return a length (meter) as a rounded decimal.

    Values within rounding errors of 0 become 0.
    """
    if abs(value) <= ZERO_COMPONENT:
        return sp.S.Zero
    return sp.Rational(mpmath.nstr(value, AXIS_DIGITS))
