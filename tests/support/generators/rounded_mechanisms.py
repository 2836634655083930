"""Robots with loops on an arbitrarily rotated base, with all numbers rounded to decimals.

Other programs write frames with a fixed number of decimal places.
"""

from dataclasses import replace

import mpmath
import numpy as np
import sympy as sp

from chasles.derive.description.pose_error import pose_in_digits
from chasles.derive.model.mechanism import Frame, Mechanism
from chasles.derive.model.placements import Placement, from_xyz_rpy

GIMBAL = 1e-9
"""If the cosine of the pitch is below this value, roll and yaw rotate about the same axis."""


def rounded(mechanism: Mechanism, places: int, turn: Placement = ()) -> Mechanism:
    """Round the lengths (meter) and angles (radian) of a mechanism to a number of decimal places.

    Args:
        mechanism: The robot in exact numbers.
        places: Number of decimal places.
        turn: Rotation of the whole robot before rounding.
    """
    values = {parameter.symbol: parameter.value for parameter in mechanism.parameters}

    def placed(placement: Placement, body: str = "") -> Placement:
        before = turn if body == mechanism.base_frame else ()
        return _in_decimals((*before, *placement), values, places)

    def frame(of: Frame) -> Frame:
        return replace(of, placement=placed(of.placement, of.body))

    def number(value: sp.Expr) -> sp.Rational:
        return sp.Rational(f"{float(value.xreplace(values)):.{places}f}")

    return replace(
        mechanism,
        parameters=(),
        joints=tuple(
            replace(
                joint,
                before=placed(joint.before, joint.parent),
                after=placed(joint.after),
                convention=None,
                given=(),
            )
            for joint in mechanism.joints
        ),
        closures=tuple(replace(c, a=frame(c.a), b=frame(c.b)) for c in mechanism.closures),
        struts=tuple(
            replace(s, a=frame(s.a), b=frame(s.b), length=number(s.length))
            for s in mechanism.struts
        ),
        drives=tuple(replace(d, ratio=d.ratio.xreplace(values)) for d in mechanism.drives),
        base=placed(mechanism.base),
        tool=placed(mechanism.tool),
    )


def awkward_turn(rng: np.random.Generator) -> Placement:
    """Return a random rotation by whole microradians about all axes."""
    yaw, pitch, roll = (sp.Rational(int(x), 10**6) for x in rng.integers(-(10**6), 10**6, 3))
    zero = (sp.S.Zero,) * 3
    return from_xyz_rpy(zero, (roll, pitch, yaw))


def _in_decimals(placement: Placement, values: dict, places: int) -> Placement:
    """Return a placement as T(x, y, z) Rz(yaw) Ry(pitch) Rx(roll) in decimals."""
    with mpmath.workdps(40):
        T = pose_in_digits(placement, values)
        level = mpmath.hypot(T[0, 0], T[1, 0])
        pitch = mpmath.atan2(-T[2, 0], level)
        if level > GIMBAL:
            roll, yaw = mpmath.atan2(T[2, 1], T[2, 2]), mpmath.atan2(T[1, 0], T[0, 0])
        else:
            roll, yaw = mpmath.mpf(0), mpmath.atan2(-T[0, 1], T[1, 1])
        numbers = [*T[:3, 3], roll, pitch, yaw]
        units = [sp.Integer(int(mpmath.nint(number * 10**places))) for number in numbers]
    x, y, z, *angles = (unit / 10**places for unit in units)
    return from_xyz_rpy((x, y, z), tuple(angles))
