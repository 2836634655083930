"""Each joint in the convention that suits its calibration: complete, continuous, few numbers.

Neighbouring axes that are not parallel have a common normal, and Denavit and Hartenberg's proximal
numbers are complete and minimal. Where they are nearly parallel the normal jumps, and Hayati's
tilts take its place, with one number more. Where both fail, for axes that nearly coincide, the
joint has a whole pose.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import mpmath
import sympy as sp

from ...model.convention import AxisLine, Convention, Fitted
from ...model.errors import RobotError
from ...model.placements import Placement, Vector, from_xyz_rpy, rotation, translation
from ...model.robot import Joint, Parameter, SerialRobot
from ...model.tolerances import CONTINUOUS_MODEL, EVALUATION_DIGITS, ZERO_COMPONENT
from ..pose_error import pose_in_digits
from .axis_lines import angle, fitted, length
from .denavit_hartenberg import mdh
from .five_parameters import hayati5
from .neighbours import Neighbours, least_singular_value, neighbours
from .urdf_origin import urdf

SUITED = (mdh, hayati5, urdf)
"""Conventions whose fields place the joint's own axis, so that they mix; few numbers first."""
_ORIGIN = (mpmath.mpf(0),) * 3


def suitable_convention(pair: Neighbours) -> Convention:
    """The first of :data:`SUITED` that is continuous at a joint; the last is so everywhere."""
    for convention in SUITED[:-1]:
        if least_singular_value(pair.displacements(convention)) > CONTINUOUS_MODEL:
            return convention
    return SUITED[-1]


def suitable_conventions(robot: SerialRobot) -> tuple[tuple[Neighbours, Convention], ...]:
    """Each moving joint with the convention that suits it.

    The place of a sliding joint is free, and here it passes through the origin of the link before.
    """
    with mpmath.workdps(EVALUATION_DIGITS):
        placed, _ = _placed(neighbours(robot))
        return tuple((item.pair, item.convention) for item in placed)


def with_suitable_conventions(robot: SerialRobot) -> SerialRobot:
    """The same robot, with each joint in the convention that suits it.

    The pose of the tool stays, and so do coordinates, limits and mimic laws. Frames of links are
    those of the conventions, and fixed joints become part of the links. Numbers are exact where
    they are multiples of 15 degrees or have fewer than 25 digits.

    Args:
        robot: A serial robot in any conventions; its named parameters take their values.

    Raises:
        RobotError: The robot has masses, whose places are in the frames of its links.
    """
    if robot.load is not None:
        raise RobotError(
            f"{robot.name}: its masses are placed in the frames of its links, which change with "
            "the conventions; name the conventions of its joints"
        )
    with mpmath.workdps(EVALUATION_DIGITS):
        pairs = neighbours(robot)
        values = {parameter.symbol: parameter.value for parameter in robot.parameters}
        placed, frame = _placed(pairs)
        tool = frame**-1 * _home(robot, values)
        joints = tuple(item.as_joint() for item in placed)
        return replace(
            robot,
            joints=joints,
            base=_placement(placed[0].before),
            tool=_placement(tool),
            parameters=_used(robot, joints),
        )


@dataclass
class _Placed:
    """A joint on the way into its convention.

    Attributes:
        pair: The joint as it was described, and the one before.
        convention: The convention that suits it.
        fitted: Its fields.
        before: (4, 4) frame of the axis before, with the turn and shift that the fields need.
        turn: Turn of the joint's own frame about its axis, which the next joint needs (radian).
        shift: Shift along its axis, likewise (metre).
    """

    pair: Neighbours
    convention: Convention
    fitted: Fitted
    before: Any
    turn: sp.Expr = sp.S.Zero
    shift: sp.Expr = sp.S.Zero

    def fields(self) -> dict[str, sp.Expr | Vector]:
        """The values of all fields, turn and shift included."""
        fields = dict(self.fitted.values)
        if self.convention.turning:
            return fields | {
                self.convention.turning: self.turn,
                self.convention.sliding: self.shift,
            }
        # A whole pose takes turn and shift into its roll, pitch and yaw.
        T = pose_in_digits(self._own() + _along_z(self.turn, self.shift), {})
        xyz, rpy = _xyz_rpy(T)
        return fields | {"xyz": xyz, "rpy": rpy}

    def _own(self) -> Placement:
        return self.convention(self.pair.joint.kind, **self.fitted.values)[0]

    def after(self) -> Any:
        """(4, 4) the joint's frame without turn and shift."""
        return self.before * pose_in_digits(self._own(), {})

    def as_joint(self) -> Joint:
        """The joint in its convention."""
        given = self.convention.scalars(
            {f.name: f.value(self.fields()) for f in self.convention.fields}
        )
        before, after = self.convention(self.pair.joint.kind, **self.fields())
        return replace(
            self.pair.joint,
            before=before,
            after=after,
            convention=self.convention,
            given=given,
            assumed=tuple(name for name in self.pair.joint.assumed if name in ("limits", "pitch")),
        )


def _placed(pairs: Sequence[Neighbours]) -> tuple[list[_Placed], Any]:
    """The joints in their conventions, and the frame of the last one."""
    first = pairs[0]
    # The base frame's six numbers place the first axis.
    placed = [_Placed(first, SUITED[0], fitted({}), first.frame)]
    frame = original = first.frame
    for pair in pairs[1:]:
        original = original * pair.frame
        relative = frame**-1 * original
        moved = replace(pair, line=_line(relative, pair.joint))
        convention = suitable_convention(moved)
        found = moved.fit(convention)
        assert found is not None
        frame = frame * pose_in_digits(_along_z(found.turn, found.shift), {})
        placed[-1].turn, placed[-1].shift = found.turn, found.shift
        placed.append(_Placed(moved, convention, found, frame))
        frame = placed[-1].after()
    return placed, frame


def _line(relative: Any, joint: Joint) -> AxisLine:
    """The axis of a joint; a sliding one's is moved to the origin, since its place is free."""
    point = _ORIGIN if joint.kind == "prismatic" else tuple(relative[:3, 3])
    return AxisLine(tuple(relative[:3, 2]), point)


def _along_z(turn: sp.Expr, shift: sp.Expr) -> Placement:
    return rotation("z", turn) + translation(sp.S.Zero, sp.S.Zero, shift)


def _home(robot: SerialRobot, values: dict[sp.Symbol, sp.Expr]) -> Any:
    """(4, 4) pose of the tool with every moving joint at zero."""
    return pose_in_digits(tuple(motion for p in robot.placements for motion in p), values)


def _placement(T: Any) -> Placement:
    return from_xyz_rpy(*_xyz_rpy(T))


def _xyz_rpy(T: Any) -> tuple[Vector, Vector]:
    """Position, and roll, pitch and yaw with R = Rz(yaw) Ry(pitch) Rx(roll)."""
    pitch = mpmath.atan2(-T[2, 0], mpmath.hypot(T[0, 0], T[1, 0]))
    is_locked = mpmath.hypot(T[0, 0], T[1, 0]) <= ZERO_COMPONENT
    yaw = mpmath.mpf(0) if is_locked else mpmath.atan2(T[1, 0], T[0, 0])
    # Where the x axis is vertical, roll and yaw are one turn, and the yaw is zero.
    c, s = mpmath.cos(yaw), mpmath.sin(yaw)
    roll = mpmath.atan2(s * T[0, 2] - c * T[1, 2], c * T[1, 1] - s * T[0, 1])
    x, y, z = (length(T[k, 3]) for k in range(3))
    return (x, y, z), (angle(roll), angle(pitch), angle(yaw))


def _used(robot: SerialRobot, joints: Sequence[Joint]) -> tuple[Parameter, ...]:
    """The parameters that pitches name."""
    used = {symbol for joint in joints for symbol in joint.pitch.free_symbols}
    return tuple(parameter for parameter in robot.parameters if parameter.symbol in used)
