"""Tasks of a planar arm on a rotating base: position with pitch or with direction."""

import numpy as np
from numpy.typing import NDArray

from ...model.robot import SerialRobot
from ...model.tolerances import OBLIQUE_AXES, TOOL_ON_AXIS
from ...terms.vectors import IDENTITY, combination, cross
from ..steps.plane import (
    ARM,
    in_plane,
    leave,
    reach,
    turn_to_direction,
    turned_as_one,
    turned_to_plane,
)
from ..steps.work import Work
from ..structure.lines import Lines, home_of, numbers
from ..subproblems.found import FoundTurn
from ..subproblems.sp1 import sp1
from ..subproblems.turns import CosSin, rotated
from .partial_poses import (
    PITCH,
    POSITION,
    name_direction,
    position_direction,
    position_pitch,
    tool_axis,
    tool_origin,
)
from .task import Solved, Task


def _has_pitch(robot: SerialRobot, lines: Lines) -> bool:
    if abs(float(lines.axes[0].direction[2])) < 1 - TOOL_ON_AXIS:
        return False
    if len(lines.axes) > ARM:
        return max(off_axis(robot, lines, ARM)) < TOOL_ON_AXIS
    return abs(float(_home(robot, lines)[:3, 2] @ in_plane(lines)[0].direction)) < TOOL_ON_AXIS


def _has_direction(robot: SerialRobot, lines: Lines) -> bool:
    if len(lines.axes) > ARM:
        return max(off_axis(robot, lines, ARM)) < TOOL_ON_AXIS
    return off_axis(robot, lines, lines.axes.index(in_plane(lines)[0]))[1] > OBLIQUE_AXES


def off_axis(robot: SerialRobot, lines: Lines, k: int) -> tuple[float, float]:
    """Return (distance of the tool origin from an axis, sine of the angle to the tool z axis)."""
    axis, home = lines.axes[k], _home(robot, lines)
    lever = np.cross(axis.direction, home[:3, 3] - axis.origin)
    tilt = np.cross(axis.direction, home[:3, 2])
    return float(np.linalg.norm(lever)), float(np.linalg.norm(tilt))


def _home(robot: SerialRobot, lines: Lines) -> NDArray[np.float64]:
    return np.array([numbers(lines.terms, row) for row in home_of(robot, lines.terms).tolist()])


def _with_pitch(robot: SerialRobot, lines: Lines) -> Solved:
    terms, a2 = lines.terms, in_plane(lines)[0]
    work = Work(terms)
    tool, axis = tool_origin(robot, terms), tool_axis(robot, terms)
    pitch = CosSin(*terms.cos_sin(PITCH))
    U, _ = turned_to_plane(work, lines, tool, POSITION)
    # The tool may point away from axis 1 or towards axis 1.
    sign = work.sign()
    _, _, up = IDENTITY
    outward = cross(terms, a2.h, up)
    wanted = combination(terms, (terms.let(sign * pitch.c), pitch.s), (outward, up))
    found = sp1(terms, a2.h, axis, wanted)
    found = FoundTurn(found.turn, found.equation, sign)
    reason = (
        "the sum of these angles determines the pitch of the tool, which points outward or inward"
    )
    total = turned_as_one(work, lines, found, reason)
    reach(work, lines, tool, U, total)
    leave(work, lines, ARM)
    return position_pitch(robot, work, up, pitch)


def _with_direction(robot: SerialRobot, lines: Lines) -> Solved:
    terms, a1, a2 = lines.terms, lines.axes[0], in_plane(lines)[0]
    work = Work(terms)
    tool, axis = tool_origin(robot, terms), tool_axis(robot, terms)
    direction = name_direction(work)
    U, q1 = turn_to_direction(work, lines, a2, (tool, POSITION), (axis, direction))
    v = rotated(terms, a1.h, q1.back, direction)
    total = turned_as_one(
        work,
        lines,
        sp1(terms, a2.h, axis, v),
        "the sum of these angles rotates the tool in the arm plane",
    )
    reach(work, lines, tool, U, total)
    leave(work, lines, ARM)
    return position_direction(robot, work)


WITH_PITCH = Task("ik_position_pitch", _with_pitch, _has_pitch)
WITH_DIRECTION = Task("ik_position_direction", _with_direction, _has_direction)
