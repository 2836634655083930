"""Reduces a chain to groups of parallel joint axes.

The equations of every serial robot are built from the groups of parallel joint axes.

A chain is a product of rotations about z, constant rotations about x (tilts) and translations.
Adjacent rotations of the chain about z are merged. Therefore consecutive parallel axes share one
angle, which is the sum of their joint angles:

    R_0_ee = Rz(phi_1) Rx(alpha_1) Rz(phi_2) Rx(alpha_2) ...

A *group* consists of consecutive parallel axes between two tilts. All axes of a group are along the
z axis of the group frame. A *station* consists of the angle phi of one revolute joint and the
translation to the next joint axis. The field `reach` of a station contains the translation to the
next joint axis, in axes that rotate with the angle phi. A joint axis that is antiparallel to the z
axis of its group stays in the group, with the sign -1. A rotation by a constant right angle
permutes the coordinate axes and needs no arithmetic operations.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import NamedTuple

import mpmath
import sympy as sp

from ..model.robot import Placement, Rotation, SerialRobot
from ..model.tolerances import EVALUATION_DIGITS, ROUNDING
from ..model.values import Values
from ..terms.terms import Terms
from ..terms.vectors import (
    IDENTITY,
    ONE,
    ORIGIN,
    ZERO,
    Basis,
    Vector,
    combination,
    rotated_z,
    turned_about_x,
    turned_about_z,
)

ANGLE_FRACTIONS = 24
"""A constant angle that equals a multiple of pi divided by this number, except for rounding errors,
is replaced by the exact multiple."""


@dataclass(frozen=True)
class SlidingJoint:
    """A prismatic joint with its index among the moving joints.

    The direction of the prismatic joint is expressed in axes that rotate with the `Station` of this
    joint.
    """

    joint: int
    direction: Vector


@dataclass(frozen=True)
class LinkFrame:
    """A link frame or the tool frame, with its constant orientation."""

    name: str
    orientation: Basis
    origin: Vector


@dataclass(frozen=True)
class Station:
    """One rotation angle of a group, with the prismatic joints and frames rotated by this angle.

    Attributes:
        joint: Index of the revolute or helical joint of the station, or None for the first station
            of a group.
        sign: Direction of the joint axis: 1 along the z axis of the group, -1 opposite to this
            axis.
        pitch: Advance of a helical joint along its axis per radian.
        angle: Rotation angle of the station about the z axis of the group frame.
        reach: Vector from the axis of ``joint`` to the next joint axis, in axes that are rotated by
            ``angle``.
        slides: The prismatic joints between the axis of ``joint`` and the next joint axis.
        frames: The link frames between the axis of ``joint`` and the next joint axis.
    """

    joint: int | None
    sign: int
    pitch: sp.Expr
    angle: sp.Expr
    reach: Vector = ORIGIN
    slides: tuple[SlidingJoint, ...] = ()
    frames: tuple[LinkFrame, ...] = ()

    @property
    def joints(self) -> tuple[int, ...]:
        """Indices of the moving joints of the station, in order."""
        turning = () if self.joint is None else (self.joint,)
        return (*turning, *(slide.joint for slide in self.slides))

    def mapped(self, change: Callable[[Vector], Vector]) -> "Station":
        """Return a copy of the station, with ``change`` applied to each vector."""
        slides = (replace(slide, direction=change(slide.direction)) for slide in self.slides)
        frames = (
            LinkFrame(frame.name, _mapped(frame.orientation, change), change(frame.origin))
            for frame in self.frames
        )
        return replace(self, reach=change(self.reach), slides=tuple(slides), frames=tuple(frames))


@dataclass(frozen=True)
class Group:
    """Consecutive parallel axes."""

    stations: tuple[Station, ...]
    tilt: tuple[sp.Expr, sp.Expr] = (ONE, ZERO)


class _Turn(NamedTuple):
    """A constant rotation about x or z, whose angle is exact or has 40 digits."""

    axis: str
    angle: sp.Expr


@dataclass
class _Stretch:
    rotations: list[_Turn] = field(default_factory=list)
    reach: Vector = ORIGIN
    slides: list[SlidingJoint] = field(default_factory=list)
    frames: list[LinkFrame] = field(default_factory=list)


def groups(robot: SerialRobot, terms: Terms, values: Sequence[sp.Expr]) -> tuple[Group, ...]:
    """Return the groups of parallel axes of a robot.

    Args:
        robot: The description.
        terms: Table of named terms, to which this function adds the constants and angles of the
            robot.
        values: The value of every moving joint (radian or meter).

    Returns:
        The groups of parallel axes, from base to tool. The last frame of the last group is the tool
        frame.
    """
    stretches, turning = _stretches(robot, terms, values)
    builder = _Builder(terms)
    builder.stretch(stretches[0])
    for (joint, pitch), stretch in zip(turning, stretches[1:], strict=True):
        builder.joint(joint, values[joint], pitch)
        builder.stretch(stretch)
    return builder.finish(robot.tool_frame)


def _stretches(
    robot: SerialRobot, terms: Terms, values: Sequence[sp.Expr]
) -> tuple[list[_Stretch], list[tuple[int, sp.Expr]]]:
    stretches = [_Stretch()]
    turning: list[tuple[int, sp.Expr]] = []
    orientation = _append(terms, stretches[-1], IDENTITY, robot.base)
    moving = 0
    for joint, link in zip(robot.joints, robot.link_names, strict=True):
        orientation = _append(terms, stretches[-1], orientation, joint.before)
        if joint.kind == "prismatic":
            _, _, z = orientation
            stretches[-1].slides.append(SlidingJoint(moving, z))
            _advance(terms, stretches[-1], orientation, (ZERO, ZERO, values[moving]))
        elif joint.kind != "fixed":
            turning.append((moving, joint.pitch))
            stretches.append(_Stretch())
            orientation = IDENTITY
            _advance(terms, stretches[-1], orientation, (ZERO, ZERO, joint.pitch * values[moving]))
        moving += joint.kind != "fixed"
        orientation = _append(terms, stretches[-1], orientation, joint.after)
        stretches[-1].frames.append(LinkFrame(link, orientation, stretches[-1].reach))
    _append(terms, stretches[-1], orientation, robot.tool)
    return stretches, turning


def _append(terms: Terms, stretch: _Stretch, orientation: Basis, placement: Placement) -> Basis:
    for motion in placement:
        if isinstance(motion, Rotation):
            for turn in _about_x_and_z(motion):
                stretch.rotations.append(turn)
                c, s = terms.cos_sin(turn.angle)
                turned = turned_about_x if turn.axis == "x" else turned_about_z
                orientation = turned(terms, orientation, c, s)
        else:
            _advance(terms, stretch, orientation, motion.vector)
    return orientation


def _advance(terms: Terms, stretch: _Stretch, orientation: Basis, vector: Vector) -> None:
    stretch.reach = combination(terms, (ONE, *vector), (stretch.reach, *orientation))


def _about_x_and_z(motion: Rotation) -> tuple[_Turn, ...]:
    if motion.axis != "y":
        return (_Turn(motion.axis, motion.angle),)
    quarter = sp.pi / 2
    return _Turn("z", quarter), _Turn("x", motion.angle), _Turn("z", -quarter)


def _reduced(rotations: Sequence[_Turn]) -> list[_Turn]:
    reduced: list[_Turn] = []
    for rotation in rotations:
        angle = rotation.angle
        if reduced and reduced[-1].axis == rotation.axis:
            angle += reduced.pop().angle
        if not (angle / (2 * sp.pi)).is_Integer:
            reduced.append(_Turn(rotation.axis, angle))
    return reduced


def _factored(terms: Terms, rotations: Sequence[_Turn]) -> list[_Turn]:
    reduced = _reduced(rotations)
    if sum(rotation.axis == "x" for rotation in reduced) <= 1 or not all(
        terms.is_number(rotation.angle) for rotation in reduced
    ):
        return reduced
    with mpmath.workdps(EVALUATION_DIGITS):
        matrix = mpmath.eye(3)
        for rotation in reduced:
            matrix *= _matrix(rotation)
        tilt = mpmath.atan2(mpmath.hypot(matrix[0, 2], matrix[1, 2]), matrix[2, 2])
        if abs(mpmath.sin(tilt)) < ROUNDING:
            sign = mpmath.sign(matrix[2, 2])
            angles = [mpmath.atan2(matrix[1, 0], matrix[0, 0]), mpmath.acos(sign), mpmath.mpf(0)]
        else:
            first = mpmath.atan2(matrix[0, 2], -matrix[1, 2])
            angles = [first, tilt, mpmath.atan2(matrix[2, 0], matrix[2, 1])]
        a, alpha, b = (_recognised(angle) for angle in angles)
    return _reduced([_Turn("z", a), _Turn("x", alpha), _Turn("z", b)])


def _matrix(rotation: _Turn) -> mpmath.matrix:
    angle = Values().of(rotation.angle)
    c, s = mpmath.cos(angle), mpmath.sin(angle)
    if rotation.axis == "x":
        return mpmath.matrix([[1, 0, 0], [0, c, -s], [0, s, c]])
    return mpmath.matrix([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def _recognised(angle: mpmath.mpf) -> sp.Expr:
    parts = angle * ANGLE_FRACTIONS / mpmath.pi
    nearest = int(mpmath.nint(parts))
    if abs(parts - nearest) < ROUNDING:
        return sp.pi * sp.Rational(nearest, ANGLE_FRACTIONS)
    return sp.Float(angle, EVALUATION_DIGITS)


class _Builder:
    """Collects the joints of a chain into groups of parallel axes.

    Attributes:
        groups: The finished groups.
        stations: The stations of the last group, which is not finished yet.
        turned: Sum of the joint values in the last group.
        offset: Sum of the constant angles in the last group.
        unsettled: Constant angle after the last joint, which the builder later adds to the angle of
            the last station.
        sign: -1 if the joint axes are opposite to the z axis of the group, otherwise 1.
    """

    stations: list[Station]
    turned: sp.Expr
    offset: sp.Expr
    unsettled: sp.Expr
    sign: int

    def __init__(self, terms: Terms) -> None:
        self.terms = terms
        self.groups: list[Group] = []
        self._open_group()

    def joint(self, joint: int, value: sp.Expr, pitch: sp.Expr) -> None:
        turned = self.turned + self.sign * value
        self.turned = sp.expand(turned) if self.terms.solved else self.terms.let(turned)
        self.stations.append(Station(joint, self.sign, pitch, self._angle()))

    def stretch(self, stretch: _Stretch) -> None:
        """Add the constant transform after a joint.

        If the constant transform tilts the next joint axis, a new group of parallel axes starts.
        """
        self._fill(stretch)
        for rotation in _factored(self.terms, stretch.rotations):
            if rotation.axis == "z":
                self.offset += self.sign * rotation.angle
                self.unsettled += self.sign * rotation.angle
            elif abs(rotation.angle) == sp.pi:
                self.sign = -self.sign
            else:
                self._close_group(rotation.angle)

    def finish(self, tool: str) -> tuple[Group, ...]:
        self._settle()
        last = self.stations[-1]
        frame = LinkFrame(tool, _mapped(IDENTITY, partial(_flipped, self.sign)), last.reach)
        self.stations[-1] = replace(last, frames=(*last.frames, frame))
        self.groups.append(Group(tuple(self.stations)))
        return tuple(self.groups)

    def _open_group(self) -> None:
        self.stations = [Station(None, 1, ZERO, ZERO)]
        self.turned, self.offset, self.unsettled = ZERO, ZERO, ZERO
        self.sign = 1

    def _close_group(self, tilt: sp.Expr) -> None:
        self._settle()
        # If the axes at the start and the end of a group are antiparallel, the tilt to the next
        # group increases by pi.
        total = tilt if self.sign == 1 else tilt + sp.pi
        self.groups.append(Group(tuple(self.stations), self.terms.cos_sin(total)))
        self._open_group()

    def _fill(self, stretch: _Stretch) -> None:
        self.unsettled = ZERO
        filled = replace(
            self.stations[-1],
            reach=stretch.reach,
            slides=tuple(stretch.slides),
            frames=tuple(stretch.frames),
        )
        self.stations[-1] = filled.mapped(partial(_flipped, self.sign))

    def _settle(self) -> None:
        """Add the constant angles after the last joint to the angle of the last station.

        The vectors of the last station are rotated back by the sum of the added constant angles.
        """
        c, s = self.terms.cos_sin(-self.unsettled)
        settled = replace(self.stations[-1], angle=self._angle())
        self.stations[-1] = settled.mapped(lambda v: rotated_z(self.terms, v, c, s))
        self.unsettled = ZERO

    def _angle(self) -> sp.Expr:
        return self.turned + self.offset


def _mapped(basis: Basis, change: Callable[[Vector], Vector]) -> Basis:
    x, y, z = basis
    return change(x), change(y), change(z)


def _flipped(sign: int, vector: Vector) -> Vector:
    x, y, z = vector
    return x, sign * y, sign * z
