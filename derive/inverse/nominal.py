"""Nominal arm of a calibrated arm.

The joint axes of the nominal arm fit a known structure of axes exactly.

In a measured arm, no two axes are exactly parallel and no two axes intersect exactly. The solutions
of the nominal arm are start values for Newton's method on the measured arm.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import mpmath
import numpy as np
import sympy as sp
from numpy.typing import NDArray

from ..model.placements import inverse
from ..model.robot import Joint, Placement, Rotation, SerialRobot, Translation
from ..model.tolerances import EVALUATION_DIGITS, NOMINAL_GUARD_DIGITS
from .classify import Attempt
from .structure.lines import Lines, home_of
from .structure.requirement import Requirement

FloatArray = NDArray[np.float64]


def nominal_of(robot: SerialRobot, lines: Lines, found: Attempt) -> SerialRobot:
    """Return the nominal arm of a robot.

    The axes of the nominal arm satisfy all conditions of an inverse kinematics family exactly.

    Args:
        robot: The calibrated arm.
        lines: The axes of the calibrated arm.
        found: The axis structure that the calibrated arm fits approximately.

    Returns:
        Nominal robot, which has no parameters. Its home pose is the home pose of the calibrated
        arm.
    """
    axes = dict(enumerate(lines.axes))
    free = [k for k in axes if k not in found.given]
    order = free[::-1] if found.backwards else free
    directions = {k: _nearest_upright(axis.direction, found.deviation) for k, axis in axes.items()}
    origins = {k: axis.origin for k, axis in axes.items()}
    for requirement in _all(found.requirements):
        _make_parallel(directions, [order[k] for k in requirement.parallel])
    for requirement in _all(found.requirements):
        _make_across(directions, [order[k] for k in requirement.across])
    for requirement in _all(found.requirements):
        _make_meet(directions, origins, [order[k] for k in requirement.meeting])
    joints = tuple(_joint(joint, directions[k], origins[k]) for k, joint in enumerate(robot.moving))
    home = home_of(robot, lines.terms)
    tool = _placement([[_number(lines.terms.value(e)) for e in row] for row in home.tolist()])
    return replace(robot, joints=joints, base=(), tool=tool, parameters=())


def _all(requirements: Iterable[Requirement]) -> Iterable[Requirement]:
    for requirement in requirements:
        yield requirement
        yield from requirement.parts


def _nearest_upright(h: FloatArray, deviation: float) -> FloatArray:
    k = int(np.argmax(np.abs(h)))
    upright = np.zeros(3)
    upright[k] = np.sign(h[k])
    return upright if float(np.linalg.norm(h - upright)) <= deviation else h


def _make_parallel(directions: dict[int, FloatArray], indices: Sequence[int]) -> None:
    for k in indices[1:]:
        first = directions[indices[0]]
        directions[k] = first * np.sign(first @ directions[k])


def _make_across(directions: dict[int, FloatArray], indices: Sequence[int]) -> None:
    if not indices:
        return
    first, second = (directions[k] for k in indices)
    turned = first - (first @ second) * second
    directions[indices[0]] = turned / np.linalg.norm(turned)


def _make_meet(
    directions: dict[int, FloatArray], origins: dict[int, FloatArray], indices: Sequence[int]
) -> None:
    if not indices:
        return
    across = {k: np.eye(3) - np.outer(directions[k], directions[k]) for k in indices}
    center = np.linalg.solve(
        sum(across.values(), np.zeros((3, 3))),
        sum((P @ origins[k] for k, P in across.items()), np.zeros(3)),
    )
    for k in indices:
        origins[k] = np.asarray(center, dtype=np.float64)


def _joint(joint: Joint, h: FloatArray, p: FloatArray) -> Joint:
    """Return a copy of a joint, placed on the axis through the point p with direction h."""
    with mpmath.workdps(EVALUATION_DIGITS):
        x, y, z = (mpmath.mpf(float(component)) for component in h)
        azimuth, tilt = mpmath.atan2(x, -y), mpmath.atan2(mpmath.hypot(x, y), z)
        upright = x == y == 0
        tilted = (Rotation("x", _angle(tilt)),)
        turns = tilted if upright else (Rotation("z", _angle(azimuth)), *tilted)
    x, y, z = (sp.Rational(float(component)) for component in p)
    before: Placement = (Translation((x, y, z)), *turns)
    return replace(joint, before=before, after=inverse(before))


def _placement(home: Sequence[Sequence[mpmath.mpf]]) -> Placement:
    """Convert a pose matrix to a translation and rotations about z, y and x, with 40 digits."""
    with mpmath.workdps(EVALUATION_DIGITS):
        level = mpmath.hypot(home[0][0], home[1][0])
        pitch = mpmath.atan2(-home[2][0], level)
        if level > _right_angle_tolerance():
            yaw = mpmath.atan2(home[1][0], home[0][0])
            roll = mpmath.atan2(home[2][1], home[2][2])
        else:
            yaw, roll = mpmath.atan2(-home[0][1], home[1][1]), mpmath.mpf(0)
        x, y, z = (sp.Rational(sp.Float(home[i][3], EVALUATION_DIGITS)) for i in range(3))
        return (
            Translation((x, y, z)),
            Rotation("z", _angle(yaw)),
            Rotation("y", _angle(pitch)),
            Rotation("x", _angle(roll)),
        )


def _number(value: sp.Expr) -> mpmath.mpf:
    return mpmath.mpf(sp.Float(value, EVALUATION_DIGITS)._mpf_)


def _angle(value: mpmath.mpf) -> sp.Expr:
    """Return an angle with 40 digits, or an exact multiple of pi/2 for a right angle."""
    quarters = mpmath.nint(2 * value / mpmath.pi)
    if abs(value - quarters * mpmath.pi / 2) < _right_angle_tolerance():
        return sp.pi * sp.Rational(int(quarters), 2)
    return sp.Rational(sp.Float(value, EVALUATION_DIGITS))


def _right_angle_tolerance() -> mpmath.mpf:
    """Return the tolerance (radian) within which an angle counts as a right angle."""
    return mpmath.mpf(10) ** (NOMINAL_GUARD_DIGITS - EVALUATION_DIGITS)
