"""A joint that turns an arm of three parallel axes, and perhaps a fifth joint that turns the tool.

Axes 2, 3 and 4 are parallel, axis 1 is perpendicular to them; a fifth is, too, if there is one.
Four joints give the tool four freedoms, its position and its pitch in the plane of the arm; a fifth
turns it about an axis in that plane. For a pose that such an arm cannot reach these steps give a
nearby pose, and the residual is the deviation from it.

Most solutions: 4 for a pose, 2 with four joints; 8 for position and pitch, as the tool may point outward or inward.
"""

import sympy as sp

from ...model.robot import Robot
from ...model.tolerances import TOOL_ON_AXIS
from ...terms.vectors import Vector, added, combination, cross, dot, subtracted
from ..steps.loop_of_three import negative
from ..steps.plane import turn_to_plane
from ..steps.target import Target
from ..steps.triangle import remaining, triangle
from ..steps.two_joints import EQUATIONS
from ..steps.work import Work
from ..structure.lines import Lines, home_of
from ..structure.requirement import Requirement, across, parallel, revolute
from ..subproblems.found import FoundTurn
from ..subproblems.sp1 import sp1
from ..subproblems.turns import CosSin, perpendicular, rotated
from ..subproblems.two_lines import component, of_two_lines
from ..tasks.partial_poses import (
    DIRECTION,
    PITCH,
    POSITION,
    POSITION_TASK,
    position_direction,
    position_pitch,
    tool_axis,
    tool_origin,
)
from ..tasks.task import Solved, Task
from .family import Family


def _requires(lines: Lines) -> list[Requirement]:
    return [
        revolute(lines, range(len(lines.axes))),
        parallel(lines, 1, 2, 3),
        across(lines, 0, 1),
        *([across(lines, 4, 1)] if len(lines.axes) > 4 else []),  # noqa: PLR2004
    ]


def _solve(work: Work, lines: Lines, target: Target) -> None:
    terms = work.terms
    a1, a2, *_ = lines.axes
    fifth = lines.axes[4:]
    # 1. The arm moves in a plane.
    carried = fifth[0].p if fifth else target.home
    meaning = f"a point of axis {fifth[0].name}" if fifth else "the tool's origin"
    wanted = work.name_vector(("W", "V"), meaning, target.point(terms, carried))
    U, q1 = _turned_as(work, lines, carried, wanted, target)
    # 2. The parallel axes turn a direction that the last joint does not.
    e = fifth[0].h if fifth else _across(lines)
    v = rotated(terms, a1.h, q1.back, target.turned(terms, e))
    q234 = _sum(work, lines, sp1(terms, a2.h, e, v), "the tool's direction in the arm's plane")
    # 3. A triangle.
    _arm(work, lines, carried, U, q234)
    # 4. The rest of the rotation.
    for axis in fifth:
        across_it = cross(terms, axis.h, a2.h)
        left = rotated(terms, a1.h, q1.back, target.turned(terms, across_it))
        left = rotated(terms, a2.h, q234.back, left)
        work.step(
            [axis], "subproblem 1", "the rest of the rotation", sp1(terms, axis.h, across_it, left)
        )


def _turned_as(
    work: Work, lines: Lines, carried: Vector, wanted: Vector, target: Target
) -> tuple[Vector, CosSin]:
    """:func:`_turned_to` where the tool's orientation determines the plane of the arm, too."""
    terms, (a1, a2, *rest) = work.terms, lines.axes
    V = subtracted(terms, wanted, a1.p)
    if len(rest) == 2:  # noqa: PLR2004
        reason = f"the other joints do not turn axis {a2.name}"
        q1 = work.step([a1], "subproblem 1", reason, sp1(terms, a1.h, a2.h, target.turned(terms, a2.h)))
    else:
        # Joints 2 to 4 keep the angle between their axes and axis 5, and the height of a point
        # of axis 5 along their axes.
        last = rest[2]
        height = dot(terms, a2.h, subtracted(terms, carried, a1.p))
        leaning = dot(terms, a2.h, last.h)
        q1 = work.step(
            [a1],
            EQUATIONS,
            f"the other joints keep the height of a point of axis {last.name} along axis {a2.name}, "
            "and the angle between both axes",
            of_two_lines(
                terms,
                component(terms, a2.h, negative(a1.h), V, height),
                component(
                    terms,
                    a2.h,
                    negative(a1.h),
                    target.turned(terms, last.h),
                    leaning,
                ),
                work.sign(),
            ),
        )
    seen = rotated(terms, a1.h, q1.back, V)
    return added(terms, seen, subtracted(terms, a1.p, a2.p)), q1


def _tool_is_free(robot: Robot, lines: Lines) -> bool:
    """Whether a fifth joint, if there is one, turns the tool about the tool's own axis."""
    if len(lines.axes) <= 4:  # noqa: PLR2004
        return True
    axis = lines.axes[4]
    matrix = home_of(robot, lines.terms)
    home = [[float(lines.terms.value(e)) for e in row] for row in matrix.tolist()]
    lever = [home[i][3] - axis.origin[i] for i in range(3)]
    tool = [home[i][2] for i in range(3)]
    h = axis.direction
    off = [h[i - 2] * lever[i - 1] - h[i - 1] * lever[i - 2] for i in range(3)]
    tilted = [h[i - 2] * tool[i - 1] - h[i - 1] * tool[i - 2] for i in range(3)]
    return bool(max(map(abs, (*off, *tilted))) < TOOL_ON_AXIS)


def _with_pitch(robot: Robot, lines: Lines) -> Solved:
    """Position and elevation of the tool's axis over the plane normal to axis 1."""
    terms, (a1, a2, *_) = lines.terms, lines.axes
    work = Work(terms)
    tool, axis = tool_origin(robot, terms), tool_axis(robot, terms)
    pitch = CosSin(*terms.cos_sin(PITCH))
    U, _ = _turned_to(work, lines, tool, POSITION)
    # The tool may point away from axis 1 or towards it.
    sign = work.sign()
    outward = cross(terms, a2.h, a1.h)
    wanted = combination(terms, (terms.let(sign * pitch.c), pitch.s), (outward, a1.h))
    found = sp1(terms, a2.h, axis, wanted)
    found = FoundTurn(found.turn, found.equation, sign)
    q234 = _sum(work, lines, found, "the pitch, with the tool pointing outward or inward")
    _arm(work, lines, tool, U, q234)
    _leave(work, lines, 4)
    return position_pitch(robot, work, a1.h, pitch)


def _with_direction(robot: Robot, lines: Lines) -> Solved:
    """Position and direction of the tool's axis."""
    terms, (a1, a2, *_) = lines.terms, lines.axes
    work = Work(terms)
    tool, axis = tool_origin(robot, terms), tool_axis(robot, terms)
    U, q1 = _turned_to(work, lines, tool, POSITION)
    v = rotated(terms, a1.h, q1.back, DIRECTION)
    q234 = _sum(work, lines, sp1(terms, a2.h, axis, v), "the tool's direction in the arm's plane")
    _arm(work, lines, tool, U, q234)
    _leave(work, lines, 4)
    return position_direction(robot, work)


def _turned_to(
    work: Work, lines: Lines, carried: Vector, position: Vector
) -> tuple[Vector, CosSin]:
    """Turns the plane of the arm to a position; returns it seen from axis 2, and the turn."""
    a1, a2, *_ = lines.axes
    reason = "the other joints move the point in the plane of the arm"
    return turn_to_plane(work, a1, a2, carried, position, reason)


def _sum(work: Work, lines: Lines, found: FoundTurn, reason: str) -> CosSin:
    return work.step(lines.axes[1:4], "subproblem 1", reason, found)


def _arm(work: Work, lines: Lines, carried: Vector, U: Vector, q234: CosSin) -> None:
    terms, (_, a2, a3, a4, *_) = work.terms, lines.axes
    lever = rotated(terms, a2.h, q234, subtracted(terms, carried, a4.p))
    triangle(work, a2, a3, a4.p, subtracted(terms, U, lever))
    remaining(work, (a2, a3, a4), q234)


def _leave(work: Work, lines: Lines, first: int) -> None:
    """Leaves joints that the task does not determine at 0."""
    for axis in lines.axes[first:]:
        work.turns[axis.joint] = CosSin(sp.Integer(1), sp.Integer(0))


def _across(lines: Lines) -> Vector:
    """The part of axis 1 perpendicular to the parallel axes."""
    a1, a2, *_ = lines.axes
    return perpendicular(lines.terms, a2.h, a1.h)


TURNTABLE = Family(
    "a turntable with three parallel axes",
    (4, 5),
    _requires,
    _solve,
    tasks=(
        POSITION_TASK,
        Task("ik_position_pitch", _with_pitch, _tool_is_free),
        Task("ik_position_direction", _with_direction, _tool_is_free),
    ),
)
