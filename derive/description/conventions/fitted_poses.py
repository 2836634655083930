"""Converts accurate poses to the fields of a kinematic convention, such as DH."""

from collections.abc import Mapping
from typing import Any

import mpmath
import sympy as sp

from ...model.convention import AxisLine
from ...model.placements import Placement, Vector, from_xyz_rpy, rotation, translation
from ...model.robot import Joint, SerialRobot
from ...model.tolerances import ZERO_COMPONENT
from ..pose_error import pose_in_digits
from .axis_lines import angle, length

_ORIGIN = (mpmath.mpf(0),) * 3


def axis_line(relative: Any, joint: Joint) -> AxisLine:
    """Return the axis of a joint from its frame (4, 4).

    The position of a prismatic axis has no effect, so the origin is used.
    """
    point = _ORIGIN if joint.kind == "prismatic" else tuple(relative[:3, 3])
    return AxisLine(tuple(relative[:3, 2]), point)


def along_z(turn: sp.Expr, shift: sp.Expr) -> Placement:
    """Return a rotation about z (radian) followed by a translation along z (meter)."""
    return rotation("z", turn) + translation(sp.S.Zero, sp.S.Zero, shift)


def home_pose(robot: SerialRobot, values: Mapping[sp.Symbol, sp.Expr]) -> Any:
    """Return the tool pose (4, 4) with all moving joints at zero."""
    return pose_in_digits(tuple(motion for p in robot.placements for motion in p), values)


def placement_of(T: Any) -> Placement:
    """Convert a pose (4, 4) to a placement with position, roll, pitch and yaw."""
    return from_xyz_rpy(*xyz_rpy_of(T))


def xyz_rpy_of(T: Any) -> tuple[Vector, Vector]:
    """Return position and (roll, pitch, yaw), with R = Rz(yaw) Ry(pitch) Rx(roll)."""
    pitch = mpmath.atan2(-T[2, 0], mpmath.hypot(T[0, 0], T[1, 0]))
    is_locked = mpmath.hypot(T[0, 0], T[1, 0]) <= ZERO_COMPONENT
    yaw = mpmath.mpf(0) if is_locked else mpmath.atan2(T[1, 0], T[0, 0])
    # If the x axis is vertical, yaw is set to 0, because roll and yaw rotate about the same axis.
    c, s = mpmath.cos(yaw), mpmath.sin(yaw)
    roll = mpmath.atan2(s * T[0, 2] - c * T[1, 2], c * T[1, 1] - s * T[0, 1])
    x, y, z = (length(T[k, 3]) for k in range(3))
    return (x, y, z), (angle(roll), angle(pitch), angle(yaw))
