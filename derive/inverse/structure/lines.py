"""Axes of a chain, as lines in its home pose.

A chain has a closed-form inverse kinematics solution if certain axes are parallel or intersect. The
axes are tested numerically, with the default values of all parameters. The closed-form solution is
then derived with exact expressions.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import pairwise

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from ...model.robot import Joint, JointKind, Placement, Rotation, SerialRobot
from ...model.sizes import addends
from ...model.tolerances import EXACT_STRUCTURE, MEASURED_STRUCTURE
from ...terms.terms import Terms
from ...terms.vectors import (
    IDENTITY,
    ORIGIN,
    Basis,
    Vector,
    combination,
    named,
    turned_about_x,
    turned_about_z,
)

Frame = tuple[Basis, Vector]


MAX_ADDENDS = 16
"""Maximum number of addends of a symbolic constant that is expanded."""
TOOL_AXIS, ADDED_AXIS = "tool_axis", "added_axis"
"""Name of a joint that is added on the tool axis, and name of a joint that is added on any other
axis."""
SOME_SLIDE = 0.6180339887
"""Generic value of prismatic joints (meter)."""
SOME_TURN = 0.7548776662
"""Generic value of revolute joints (radian)."""
APART = 0.5698402910
"""Relative increase of the generic joint value per joint number, modulo 1."""


@dataclass(frozen=True)
class Axis:
    """The axis of a joint in the home pose.

    Attributes:
        joint: Index of the moving joint.
        name: Name of the joint.
        kind: Revolute or prismatic.
        h: Direction of the axis (unit vector), in base axes.
        p: A point on the axis (meter).
        direction: The direction h as a floating-point vector.
        origin: The point p as a floating-point vector.
        stays: Whether the joint is an added joint that always stays at 0.
    """

    joint: int
    name: str
    kind: JointKind
    h: Vector
    p: Vector
    direction: NDArray[np.float64]
    origin: NDArray[np.float64]
    stays: bool = False

    @property
    def turns(self) -> bool:
        """Whether the joint is revolute."""
        return self.kind == "revolute"

    @property
    def some_motion(self) -> float:
        """A generic joint value (radian or meter), which differs from joint to joint."""
        some = SOME_TURN if self.turns else SOME_SLIDE
        return some * (1 + self.joint * APART % 1)

    def is_along(self, other: "Axis") -> bool:
        """Whether the axis is parallel or antiparallel to another axis."""
        return bool(np.linalg.norm(np.cross(self.direction, other.direction)) <= EXACT_STRUCTURE)

    def reversed(self) -> "Axis":
        """Return the axis with the opposite direction, for a chain numbered from the tool."""
        x, y, z = self.h
        return replace(self, h=(-x, -y, -z), direction=-self.direction)

    def moved(self, p: Vector, origin: NDArray[np.float64]) -> "Axis":
        """Return a parallel axis through another point."""
        return replace(self, p=p, origin=origin)


def axes_of(robot: SerialRobot, terms: Terms) -> tuple[Axis, ...]:
    """Return the axes of the moving joints in the home pose, starting at the base."""
    frames, _ = _home_frames(robot, terms)
    return tuple(
        _axis(terms, k, joint, basis[2], origin)
        for k, (joint, (basis, origin)) in enumerate(zip(robot.moving, frames, strict=True))
    )


def home_of(robot: SerialRobot, terms: Terms) -> sp.Matrix:
    """Return ``M_0_ee`` (4, 4), the tool pose with all joints at zero."""
    _, (basis, origin) = _home_frames(robot, terms)
    T = sp.eye(4)
    for j, column in enumerate((*basis, origin)):
        T[:3, j] = sp.Matrix([_short(terms, component) for component in column])
    return T


def with_tool_axis(robot: SerialRobot, lines: "Lines", *, stays: bool) -> "Lines":
    """Add a joint about the third axis of the tool to a chain.

    Args:
        robot: The description.
        lines: The axes of the moving joints.
        stays: Whether the angle of the added joint is always 0.
    """
    terms = lines.terms
    _, ((_, _, h), origin) = _home_frames(robot, terms)
    joint = Joint(TOOL_AXIS, "revolute")
    axis = _axis(terms, len(lines.axes), joint, h, origin)
    return replace(lines, axes=(*lines.axes, replace(axis, stays=stays)))


def _home_frames(robot: SerialRobot, terms: Terms) -> tuple[list[Frame], Frame]:
    placements = robot.base, robot.joints, robot.tool
    return terms.memoize(("home frames", placements), lambda: _placed_frames(robot, terms))


def _placed_frames(robot: SerialRobot, terms: Terms) -> tuple[list[Frame], Frame]:
    frames = []
    frame = _placed(terms, (IDENTITY, ORIGIN), robot.base)
    for joint in robot.joints:
        frame = _placed(terms, frame, joint.before)
        if joint.kind != "fixed":
            frames.append(frame)
        frame = _placed(terms, frame, joint.after)
    return frames, _placed(terms, frame, robot.tool)


def _placed(terms: Terms, frame: Frame, placement: Placement) -> Frame:
    basis, origin = frame
    for motion in placement:
        if isinstance(motion, Rotation):
            c, s = terms.cos_sin(motion.angle)
            x, y, z = basis
            if motion.axis == "x":
                basis = turned_about_x(terms, basis, c, s)
            elif motion.axis == "z":
                basis = turned_about_z(terms, basis, c, s)
            else:
                basis = (combination(terms, (c, -s), (x, z)), y, combination(terms, (c, s), (z, x)))
        else:
            origin = combination(terms, (sp.Integer(1), *motion.vector), (origin, *basis))
    return basis, origin


def _axis(terms: Terms, k: int, joint: Joint, h: Vector, p: Vector) -> Axis:
    """Return the axis through the point p in the direction h.

    The stored point of a revolute axis is the axis point nearest to the base origin. The stored
    point of a prismatic axis is the base origin.
    """
    h = named(terms, (_short(terms, component) for component in h))
    written = [_short(terms, component) for component in p]
    along = _tidied(terms, sum((a * b for a, b in zip(h, written, strict=True)), sp.Integer(0)))
    near = (_tidied(terms, b - a * along) for a, b in zip(h, written, strict=True))
    point = named(terms, near) if joint.kind != "prismatic" else ORIGIN
    return Axis(k, joint.name, joint.kind, h, point, numbers(terms, h), numbers(terms, point))


def _short(terms: Terms, component: sp.Expr) -> sp.Expr:
    """Expand a symbolic constant so that terms cancel.

    Numbers and long constants are not changed.
    """
    if terms.is_number(component) or terms.addends(component) > MAX_ADDENDS:
        return component
    return sp.expand(terms.spelled(component))


def _tidied(terms: Terms, component: sp.Expr) -> sp.Expr:
    """Expand a short constant so that terms cancel, or replace a long constant by a named term."""
    return sp.expand(component) if addends(component) <= MAX_ADDENDS else terms.let(component)


def numbers(terms: Terms, vector: Iterable[sp.Expr]) -> NDArray[np.float64]:
    """Return the numerical values of a constant symbolic vector."""
    return np.array([float(terms.value(component)) for component in vector])


def rotation(k: NDArray[np.float64], angle: float | NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rotation matrices (..., 3, 3) for angles (..., 1, 1) about a unit vector k.

    The function uses the formula of Rodrigues. If the angle is a single number, the function
    returns one (3, 3) matrix.
    """
    K = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K)


@dataclass(frozen=True)
class Lines:
    """The axes of a chain, and the tolerance for their geometric conditions.

    Attributes:
        terms: Table of named terms.
        axes: The axes, starting at the base or at the tool.
        tolerance: Largest deviation of axes that count as parallel or intersecting, as an angle
            (radian) or a distance divided by the arm length.
        whole: All axes of the chain in the home configuration, or an empty tuple if no joint of the
            chain is fixed.
    """

    terms: Terms
    axes: tuple[Axis, ...]
    tolerance: float = EXACT_STRUCTURE
    whole: tuple[Axis, ...] = ()

    @property
    def is_part(self) -> bool:
        """Whether ``axes`` contains only some axes of the chain, because other joints are fixed."""
        return bool(self.whole)

    @property
    def added(self) -> tuple[Axis, ...]:
        """The axes of the joints that are added to an arm."""
        return tuple(axis for axis in self.axes if axis.name in (TOOL_AXIS, ADDED_AXIS))

    @cached_property
    def length(self) -> float:
        """Sum of distances between origins of consecutive revolute axes in the home pose (meter).

        The length of the chain does not depend on which joints are fixed.
        """
        points = [axis.origin for axis in self.whole or self.axes if axis.turns]
        return sum(float(np.linalg.norm(b - a)) for a, b in pairwise(points))

    def reversed(self) -> "Lines":
        """Return a copy with the axes in reverse order and with reversed directions."""
        return replace(self, axes=tuple(axis.reversed() for axis in self.axes[::-1]))

    def at_generic(self, given: Sequence[int]) -> "Lines":
        """Return the axes of the free joints for generic values of the fixed joints.

        The returned axes are used only to test the structure of the arm, not to solve for its
        joints.
        """
        R, t = np.eye(3), np.zeros(3)
        kept = []
        for k, axis in enumerate(self.axes):
            if k not in given:
                at = replace(axis, direction=R @ axis.direction, origin=R @ axis.origin + t)
                kept.append(at)
            elif axis.turns and kept:
                turn = rotation(axis.direction, axis.some_motion)
                t = t + R @ (axis.origin - turn @ axis.origin)
                R = R @ turn
            elif not axis.turns:
                t = t + axis.some_motion * (R @ axis.direction)
        whole = self.whole or (self.axes if given else ())
        return replace(self, axes=tuple(kept), whole=whole)

    def parallel(self, *indices: int) -> bool:
        """Whether axes are parallel or antiparallel."""
        return self.angular_deviation(indices) <= self.tolerance

    def angular_deviation(self, indices: Sequence[int]) -> float:
        """Return the largest sine of the angles between consecutive axes of a list.

        The angles between consecutive joint axes of the arm do not depend on the configuration.
        """
        directions = [self.axes[k].direction for k in indices]
        return max(float(np.linalg.norm(np.cross(a, b))) for a, b in pairwise(directions))

    def perpendicular(self, i: int, j: int) -> bool:
        """Whether the directions of two axes are perpendicular."""
        return abs(float(self.axes[i].direction @ self.axes[j].direction)) <= self.tolerance

    def meet(self, *indices: int) -> bool:
        """Whether several revolute axes are not parallel and intersect in one point."""
        return self.meeting_deviation(indices) <= self.tolerance

    def meeting_deviation(self, indices: Sequence[int]) -> float:
        """Return how far axes are from intersecting in one point, relative to the arm length.

        Let C be the point with the least sum of squared distances to all axes. The deviation is the
        largest distance between C and an axis.

        For parallel axes, the deviation is infinite, because these axes intersect at infinity.
        """
        axes = [self.axes[k] for k in indices]
        if any(
            float(np.linalg.norm(np.cross(a.direction, b.direction))) < MEASURED_STRUCTURE
            for a, b in pairwise(axes)
        ):
            return np.inf
        across = [np.eye(3) - np.outer(axis.direction, axis.direction) for axis in axes]
        center = np.linalg.solve(
            sum(across, np.zeros((3, 3))),
            sum((P @ axis.origin for P, axis in zip(across, axes, strict=True)), np.zeros(3)),
        )
        distances = [
            float(np.linalg.norm(P @ (center - axis.origin)))
            for P, axis in zip(across, axes, strict=True)
        ]
        return max(distances) / (self.length or 1.0)

    def meeting(self, i: int, j: int) -> Vector:
        """Return the exact point of axis i that is nearest to axis j."""
        a, b = self.axes[i], self.axes[j]
        h_i, h_j = (sp.Matrix(axis.h) for axis in (a, b))
        p_i, p_j = (sp.Matrix([_short(self.terms, e) for e in axis.p]) for axis in (a, b))
        normal = h_i.cross(h_j)
        tidied = partial(_tidied, self.terms)
        across = (p_j - p_i).applyfunc(tidied).cross(h_j).applyfunc(tidied)
        along = tidied(across.dot(normal) / normal.dot(normal))
        return named(self.terms, (p_i + along * h_i).applyfunc(tidied))

    def sense(self, i: int, j: int) -> int:
        """Return 1 if axes i and j have the same direction, -1 for opposite directions."""
        return 1 if float(self.axes[i].direction @ self.axes[j].direction) > 0 else -1
