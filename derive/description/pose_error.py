"""A bound of the difference between the poses of two robots with the same joints.

Each link moves by ``T = before * motion(q) * after``, which is ``T = exp([S] q) M`` with the screw
axis S of its joint and its pose M at zero. Either form gives bounds of the shift and the turn
between the links of two robots. The smaller ones are added up, each turn multiplied by the greatest
distance from there to the tool. The sums hold at all joint values within the limits.
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
"""Displacement (metre) that is assumed for slides without limits."""
_PLANES = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}
_Matrix: TypeAlias = Any
"""A matrix of mpmath, which declares no types."""
_Values = Mapping[sp.Symbol, sp.Expr]


@dataclass(frozen=True)
class _Link:
    """A link's motion in the previous link.

    Attributes:
        before: Pose (4, 4) of the joint's frame, whose z axis is the joint's axis.
        after: Pose (4, 4) of the link's frame in the joint's frame after its motion.
        turns: Whether the joint turns the link.
        travel: The greatest displacement along the axis (metre).
    """

    before: _Matrix
    after: _Matrix
    turns: bool
    travel: mpmath.mpf

    @property
    def home(self) -> _Matrix:
        """The link's pose (4, 4) at zero."""
        return self.before * self.after

    @property
    def reach(self) -> mpmath.mpf:
        """The greatest distance of the link's frame from the previous link's (metre)."""
        if not self.turns:
            return mpmath.norm(self.home[:3, 3]) + self.travel
        return mpmath.norm(self.before[:3, 3]) + mpmath.norm(self.after[:3, 3]) + self.travel


def pose_error(one: SerialRobot, other: SerialRobot) -> tuple[float, float]:
    """Bounds of the distance (metre) and the angle (radian) between the tools of two robots.

    Args:
        one: A robot.
        other: The same joints, limits and names of parameters, on placements that may differ. Each
            robot has its parameters' default values.
    """
    with mpmath.workdps(EVALUATION_DIGITS):
        position = orientation = beyond = mpmath.mpf(0)
        # From the tool to the base, so that the distance to the tool is known at each link.
        for link, same in reversed(list(zip(_links(one), _links(other), strict=True))):
            shift, turn = _difference(link, same)
            position += shift + turn * beyond
            orientation += turn
            beyond += max(link.reach, same.reach)
        return _rounded(position), _rounded(orientation)


def robot_size(robot: Described) -> float:
    """The robot's longest length (metre) at the default values of its parameters, 0 if none."""
    return max((float(length) for length in lengths(robot)), default=0.0)


def lengths(robot: Described) -> Iterator[sp.Expr]:
    """The magnitudes of all components of translations (metre) at the parameters' values."""
    values = _values(robot)
    for placement in robot.placements:
        for motion in placement:
            if not isinstance(motion, Rotation):
                yield from (abs(component.xreplace(values)) for component in motion.vector)


def _difference(link: _Link, same: _Link) -> tuple[mpmath.mpf, mpmath.mpf]:
    """Bounds of the shift of a link's origin and of the turn between two links' motions."""
    (shift, turn), (other_shift, other_turn) = _of_screws(link, same), _of_frames(link, same)
    return min(shift, other_shift), min(turn, other_turn)


def _of_frames(link: _Link, same: _Link) -> tuple[mpmath.mpf, mpmath.mpf]:
    """The bounds by the frames before and after the motion."""
    tilt = _angle(link.before, same.before)
    arm = mpmath.norm(link.after[:3, 3]) + link.travel
    shift = _distance(link.before, same.before) + tilt * arm + _distance(link.after, same.after)
    return shift, tilt + _angle(link.after, same.after)


def _of_screws(link: _Link, same: _Link) -> tuple[mpmath.mpf, mpmath.mpf]:
    """The bounds by the screws and the poses at zero, in which a frame's turn about z is free.

    Turns about two axes differ by the displacement that carries one axis onto the other, made at
    both ends of the turn.
    """
    tilt = _angle_between(link.before[:3, 2], same.before[:3, 2])
    shift = _distance(link.home, same.home) + tilt * link.travel
    turn = _angle(link.home, same.home)
    if not link.turns:
        return shift, turn
    arm = max(mpmath.norm(link.after[:3, 3]), mpmath.norm(same.after[:3, 3]))
    return shift + 2 * (_distance(link.before, same.before) + tilt * arm), turn + 2 * tilt


def _distance(one: _Matrix, other: _Matrix) -> mpmath.mpf:
    """The distance between the origins of two poses (metre)."""
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
    """A placement as a matrix, with the precision that mpmath has."""
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
    """The angle between two unit vectors, accurate where it is small."""
    return 2 * mpmath.asin(min(mpmath.mpf(1), mpmath.norm(a - b) / 2))


def _angle(one: _Matrix, other: _Matrix) -> mpmath.mpf:
    """The angle of the rotation from one pose to another, accurate where it is small."""
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
    """A bound in doubles; the rounding of this computation itself is no difference."""
    return float(bound) if bound > ROUNDING else 0.0
