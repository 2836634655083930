"""Bounds the pose difference between two robots with the same joints.

The pose of a link is ``T = before * motion(q) * after``. An equivalent formula is ``T = exp([S] q)
M``, where S is the screw axis of the joint and M is the pose at q = 0. Each of these two equations
gives bounds for the translation error and the rotation error of a link. The smaller of the two
bounds is used. The pose error is bounded by the sum of the link bounds. A rotation bound is
multiplied by the largest distance from the link to the tool. The sum of the link bounds holds for
all joint values within the limits.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import mpmath
import sympy as sp

from ..model.mechanism import Described
from ..model.placements import Placement, Rotation
from ..model.robot import Joint, SerialRobot
from ..model.tolerances import EVALUATION_DIGITS, ROUNDING

TRAVEL = 1.0
"""Assumed range (meter) of a prismatic joint without limits."""
_PLANES = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}
_Matrix: TypeAlias = Any
"""Type of mpmath matrices; mpmath has no type hints."""
_Values = Mapping[sp.Symbol, sp.Expr]


@dataclass(frozen=True)
class _Link:
    """The motion of a link relative to the preceding link.

    Attributes:
        before: Pose (4, 4) of the joint frame, whose z axis is the joint axis.
        after: Pose (4, 4) of the link in the moved joint frame.
        turns: Whether the joint is revolute or helical.
        travel: Maximum displacement along the joint axis (meter).
    """

    before: _Matrix
    after: _Matrix
    turns: bool
    travel: mpmath.mpf

    @property
    def home(self) -> _Matrix:
        """Pose (4, 4) of the link at joint value 0."""
        return self.before * self.after

    @property
    def reach(self) -> mpmath.mpf:
        """Maximum distance from the preceding link frame to this link frame (meter)."""
        if not self.turns:
            return mpmath.norm(self.home[:3, 3]) + self.travel
        return mpmath.norm(self.before[:3, 3]) + mpmath.norm(self.after[:3, 3]) + self.travel


def pose_error(one: SerialRobot, other: SerialRobot) -> tuple[float, float]:
    """Return the maximum distance (meter) and angle (radian) between the tools of two robots.

    Args:
        one: A robot.
        other: Another robot with the same joints, limits and parameter names as ``one``.
            The two robots have their default parameter values.
    """
    with mpmath.workdps(EVALUATION_DIGITS):
        position = orientation = beyond = mpmath.mpf(0)
        # The links are processed from tool to base, so the distance to the tool is known for each
        # link.
        for link, same in reversed(list(zip(_links(one), _links(other), strict=True))):
            shift, turn = _difference(link, same)
            position += shift + turn * beyond
            orientation += turn
            beyond += max(link.reach, same.reach)
        return _rounded(position), _rounded(orientation)


def robot_size(robot: Described) -> float:
    """Return the longest dimension (meter) of a robot, or 0."""
    return max((float(length) for length in lengths(robot)), default=0.0)


def lengths(robot: Described) -> Iterator[sp.Expr]:
    """Yield the absolute values (meter) of all translations at default parameters."""
    values = _values(robot)
    for placement in robot.placements:
        for motion in placement:
            if not isinstance(motion, Rotation):
                yield from (abs(component.xreplace(values)) for component in motion.vector)


def _difference(link: _Link, same: _Link) -> tuple[mpmath.mpf, mpmath.mpf]:
    """Return bounds for the difference of two link motions: a translation and a rotation angle."""
    (shift, turn), (other_shift, other_turn) = _of_screws(link, same), _of_frames(link, same)
    return min(shift, other_shift), min(turn, other_turn)


def _of_frames(link: _Link, same: _Link) -> tuple[mpmath.mpf, mpmath.mpf]:
    tilt = _angle(link.before, same.before)
    arm = mpmath.norm(link.after[:3, 3]) + link.travel
    shift = _distance(link.before, same.before) + tilt * arm + _distance(link.after, same.after)
    return shift, tilt + _angle(link.after, same.after)


def _of_screws(link: _Link, same: _Link) -> tuple[mpmath.mpf, mpmath.mpf]:
    """Return two error bounds of a link, computed from its screw axis and home pose.

    Rotations of the joint frames about their z axes do not change the screws.
    """
    tilt = _angle_between(link.before[:3, 2], same.before[:3, 2])
    shift = _distance(link.home, same.home) + tilt * link.travel
    turn = _angle(link.home, same.home)
    if not link.turns:
        return shift, turn
    arm = max(mpmath.norm(link.after[:3, 3]), mpmath.norm(same.after[:3, 3]))
    return shift + 2 * (_distance(link.before, same.before) + tilt * arm), turn + 2 * tilt


def _distance(one: _Matrix, other: _Matrix) -> mpmath.mpf:
    """Return the distance (meter) between the origins of two poses."""
    return mpmath.norm(one[:3, 3] - other[:3, 3])


def _links(robot: SerialRobot) -> Iterator[_Link]:
    values = _values(robot)
    yield _still(pose_in_digits(robot.base, values))
    for joint in robot.joints:
        before, after = pose_in_digits(joint.before, values), pose_in_digits(joint.after, values)
        if joint.kind == "fixed":
            yield _still(before * after)
        else:
            yield _Link(before, after, joint.kind != "prismatic", _travel(joint, values))
    yield _still(pose_in_digits(robot.tool, values))


def _still(home: _Matrix) -> _Link:
    return _Link(home, mpmath.eye(4), False, mpmath.mpf(0))


def _travel(joint: Joint, values: _Values) -> mpmath.mpf:
    if joint.kind == "revolute":
        return mpmath.mpf(0)
    lower, upper = joint.limits
    if joint.kind == "helical" or lower is None or upper is None:
        return mpmath.mpf(TRAVEL)
    return max(abs(_number(lower, values)), abs(_number(upper, values)))


def pose_in_digits(placement: Placement, values: _Values) -> _Matrix:
    """Return a placement as a matrix in the current precision of mpmath."""
    T = mpmath.eye(4)
    for motion in placement:
        step = mpmath.eye(4)
        if isinstance(motion, Rotation):
            angle = _number(motion.angle, values)
            c, s = mpmath.cos(angle), mpmath.sin(angle)
            j, k = _PLANES[motion.axis]
            step[j, j], step[j, k], step[k, j], step[k, k] = c, -s, s, c
        else:
            for i, component in enumerate(motion.vector):
                step[i, 3] = _number(component, values)
        T = T * step
    return T


def _angle_between(a: _Matrix, b: _Matrix) -> mpmath.mpf:
    """Return the angle between two unit vectors."""
    return 2 * mpmath.asin(min(mpmath.mpf(1), mpmath.norm(a - b) / 2))


def _angle(one: _Matrix, other: _Matrix) -> mpmath.mpf:
    """Return the rotation angle between two poses.

    The formula is also accurate for small angles.
    """
    distance = mpmath.sqrt(sum(abs(x) ** 2 for x in one[:3, :3] - other[:3, :3]))
    return 2 * mpmath.asin(min(mpmath.mpf(1), distance / mpmath.sqrt(8)))


def _values(robot: Described) -> dict[sp.Symbol, sp.Expr]:
    return {parameter.symbol: parameter.value for parameter in robot.parameters}


def _number(expression: sp.Expr, values: _Values) -> mpmath.mpf:
    value = expression.xreplace(values)
    if value.is_Rational:
        return mpmath.mpf(value.p) / value.q
    return mpmath.mpf(sp.Float(value.evalf(EVALUATION_DIGITS), EVALUATION_DIGITS)._mpf_)


def _rounded(bound: mpmath.mpf) -> float:
    """Return a bound as a float."""
    return float(bound) if bound > ROUNDING else 0.0
