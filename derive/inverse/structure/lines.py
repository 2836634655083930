"""The axes of a chain as lines in its home pose, and their relative positions.

A chain is solvable where some of its axes are parallel or meet. This is judged in numbers at the
default values of all parameters; the inverse is then derived in exact expressions.
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


MOST_ADDENDS = 16
"""Addends of a constant in parameters up to which it is written out to let equal ones cancel."""
TOOL_AXIS, ADDED_AXIS = "tool_axis", "added_axis"
"""The name of a further joint, about the tool's axis and about another."""
SOME_SLIDE = 0.6180339887
"""A slide (metre) in general position: axes that meet at this length meet at any."""
SOME_TURN = 0.7548776662
"""A turn (radian) in general position."""
APART = 0.5698402910
"""Sets the values of different joints apart, so that opposite motions do not cancel."""


@dataclass(frozen=True)
class Axis:
    """The axis of a joint in the home pose.

    Attributes:
        joint: Index of the moving joint.
        name: Its name.
        kind: Revolute or prismatic.
        h: Its direction (unit vector), in base axes.
        p: A point on it (metre); of a prismatic joint of no meaning.
        direction: h in numbers.
        origin: p in numbers.
        stays: Whether the joint is none of the arm's, and its angle is 0.
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
        """A value of the joint (radian or metre) in general position, one of its own."""
        some = SOME_TURN if self.turns else SOME_SLIDE
        return some * (1 + self.joint * APART % 1)

    def is_along(self, other: "Axis") -> bool:
        """Whether the axis has the direction of another one, or the opposite."""
        return bool(np.linalg.norm(np.cross(self.direction, other.direction)) <= EXACT_STRUCTURE)

    def reversed(self) -> "Axis":
        """The axis as one sees it from the tool: it turns the other way."""
        x, y, z = self.h
        return replace(self, h=(-x, -y, -z), direction=-self.direction)

    def moved(self, p: Vector, origin: NDArray[np.float64]) -> "Axis":
        """The same axis with another point of it as origin."""
        return replace(self, p=p, origin=origin)


def axes_of(robot: SerialRobot, terms: Terms) -> tuple[Axis, ...]:
    """The axes of a serial robot's moving joints in its home pose, from the base."""
    frames, _ = _home_frames(robot, terms)
    return tuple(
        _axis(terms, k, joint, basis[2], origin)
        for k, (joint, (basis, origin)) in enumerate(zip(robot.moving, frames, strict=True))
    )


def home_of(robot: SerialRobot, terms: Terms) -> sp.Matrix:
    """``M_0_ee`` (4, 4), the tool's pose with every joint at zero."""
    _, (basis, origin) = _home_frames(robot, terms)
    T = sp.eye(4)
    for j, column in enumerate((*basis, origin)):
        T[:3, j] = sp.Matrix([_short(terms, component) for component in column])
    return T


def with_tool_axis(robot: SerialRobot, lines: "Lines", *, stays: bool) -> "Lines":
    """The chain with a further joint, which turns the tool about its own third axis.

    Args:
        robot: The description.
        lines: Its axes.
        stays: Whether the angle of the further joint is 0, or whatever the task leaves.
    """
    terms = lines.terms
    _, ((_, _, h), origin) = _home_frames(robot, terms)
    joint = Joint(TOOL_AXIS, "revolute")
    axis = _axis(terms, len(lines.axes), joint, h, origin)
    return replace(lines, axes=(*lines.axes, replace(axis, stays=stays)))


def _home_frames(robot: SerialRobot, terms: Terms) -> tuple[list[Frame], Frame]:
    """The frames of the moving joints in the home pose, and the tool's."""
    frames = []
    frame = _placed(terms, (IDENTITY, ORIGIN), robot.base)
    for joint in robot.joints:
        frame = _placed(terms, frame, joint.before)
        if joint.kind != "fixed":
            frames.append(frame)
        frame = _placed(terms, frame, joint.after)
    return frames, _placed(terms, frame, robot.tool)


def _placed(terms: Terms, frame: Frame, placement: Placement) -> Frame:
    """A frame moved by a constant placement, with named components."""
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
    """The axis through p, named by its point nearest to the base's origin."""
    h = named(terms, (_short(terms, component) for component in h))
    written = [_short(terms, component) for component in p]
    along = _tidied(terms, sum((a * b for a, b in zip(h, written, strict=True)), sp.Integer(0)))
    near = (_tidied(terms, b - a * along) for a, b in zip(h, written, strict=True))
    point = named(terms, near) if joint.kind != "prismatic" else ORIGIN
    return Axis(k, joint.name, joint.kind, h, point, numbers(terms, h), numbers(terms, point))


def _short(terms: Terms, component: sp.Expr) -> sp.Expr:
    """A constant in parameters, so that equal terms cancel; numbers and long ones keep names."""
    if terms.is_number(component) or terms.addends(component) > MOST_ADDENDS:
        return component
    return sp.expand(terms.spelled(component))


def _tidied(terms: Terms, component: sp.Expr) -> sp.Expr:
    """A constant expanded, so that equal terms cancel, or by name where that would be long."""
    return sp.expand(component) if addends(component) <= MOST_ADDENDS else terms.let(component)


def numbers(terms: Terms, vector: Iterable[sp.Expr]) -> NDArray[np.float64]:
    """A constant vector in numbers."""
    return np.array([float(terms.value(component)) for component in vector])


def rotation(k: NDArray[np.float64], angle: float) -> NDArray[np.float64]:
    """The rotation matrix about a unit vector (Rodrigues)."""
    K = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K)


@dataclass(frozen=True)
class Lines:
    """The axes of a chain, and the tolerance up to which they count as parallel or as meeting.

    Attributes:
        terms: Names of all terms.
        axes: From the base, or from the tool where the chain is read backwards.
        tolerance: Radian, or parts of the arm's length.
    """

    terms: Terms
    axes: tuple[Axis, ...]
    tolerance: float = EXACT_STRUCTURE

    @property
    def added(self) -> tuple[Axis, ...]:
        """The axes that are none of the arm's joints."""
        return tuple(axis for axis in self.axes if axis.name in (TOOL_AXIS, ADDED_AXIS))

    @cached_property
    def length(self) -> float:
        """The sum of the distances between the origins of neighbouring axes (metre)."""
        points = [axis.origin for axis in self.axes if axis.turns]
        return sum(float(np.linalg.norm(b - a)) for a, b in pairwise(points))

    def reversed(self) -> "Lines":
        """The axes numbered from the tool, each with the opposite direction."""
        return replace(self, axes=tuple(axis.reversed() for axis in self.axes[::-1]))

    def at_generic(self, given: Sequence[int]) -> "Lines":
        """The axes of joints that are not given, after given joints in general position.

        It serves to judge the structure, not to solve it.
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
        return replace(self, axes=tuple(kept))

    def parallel(self, *indices: int) -> bool:
        """Whether axes have one direction or the opposite one."""
        return self.angular_deviation(indices) <= self.tolerance

    def angular_deviation(self, indices: Sequence[int]) -> float:
        """The largest sine of the angle between axes and the first of them."""
        first, *others = (self.axes[k].direction for k in indices)
        return max(float(np.linalg.norm(np.cross(first, other))) for other in others)

    def perpendicular(self, i: int, j: int) -> bool:
        """Whether the directions of two axes are at right angles."""
        return abs(float(self.axes[i].direction @ self.axes[j].direction)) <= self.tolerance

    def meet(self, *indices: int) -> bool:
        """Whether revolute axes, no two of them parallel, pass through one point."""
        return self.meeting_deviation(indices) <= self.tolerance

    def meeting_deviation(self, indices: Sequence[int]) -> float:
        """The largest distance of axes from the point nearest to all, in parts of the arm's length.

        Infinite where neighbouring axes are parallel: a point at infinity is no centre.
        """
        axes = [self.axes[k] for k in indices]
        if any(
            float(np.linalg.norm(np.cross(a.direction, b.direction))) < MEASURED_STRUCTURE
            for a, b in pairwise(axes)
        ):
            return np.inf
        across = [np.eye(3) - np.outer(axis.direction, axis.direction) for axis in axes]
        centre = np.linalg.solve(
            sum(across, np.zeros((3, 3))),
            sum((P @ axis.origin for P, axis in zip(across, axes, strict=True)), np.zeros(3)),
        )
        distances = [
            float(np.linalg.norm(P @ (centre - axis.origin)))
            for P, axis in zip(across, axes, strict=True)
        ]
        return max(distances) / (self.length or 1.0)

    def meeting(self, i: int, j: int) -> Vector:
        """The point of axis i that is nearest to axis j, in exact expressions."""
        a, b = self.axes[i], self.axes[j]
        h_i, h_j = (sp.Matrix(axis.h) for axis in (a, b))
        p_i, p_j = (sp.Matrix([_short(self.terms, e) for e in axis.p]) for axis in (a, b))
        normal = h_i.cross(h_j)
        tidied = partial(_tidied, self.terms)
        across = (p_j - p_i).applyfunc(tidied).cross(h_j).applyfunc(tidied)
        along = tidied(across.dot(normal) / normal.dot(normal))
        return named(self.terms, (p_i + along * h_i).applyfunc(tidied))

    def sense(self, i: int, j: int) -> int:
        """1 where axis j has the direction of axis i, -1 where it has the opposite one."""
        return 1 if float(self.axes[i].direction @ self.axes[j].direction) > 0 else -1
