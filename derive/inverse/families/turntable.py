"""A joint that turns an arm in a plane, and perhaps a fifth joint that turns the tool.

Axes 2, 3 and 4 are parallel, or two of them are and the third joint slides across these, as the
telescope of a crane does. Axis 1 is perpendicular to them; a fifth is, too, if there is one. Four
joints give the tool four freedoms, its position and its pitch in the plane of the arm; a fifth
turns it about an axis in that plane. For a pose that such an arm cannot reach these steps give a
nearby pose, and the residual is the deviation from it.

Most solutions: 4 for a pose, 2 with four joints; 8 for position and pitch, as the tool may point
outward or inward.
"""

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from ...model.robot import Robot
from ...model.tolerances import OBLIQUE_AXES, TOOL_ON_AXIS
from ...terms.terms import Terms
from ...terms.vectors import IDENTITY, Vector, added, combination, cross, dot, subtracted
from ..steps.plane import seen_behind, turn_to_direction, turn_to_plane
from ..steps.target import Target
from ..steps.telescope import telescope
from ..steps.triangle import remaining, triangle
from ..steps.work import Work
from ..structure.lines import Axis, Lines, home_of, numbers
from ..structure.requirement import Requirement, across, parallel, revolute
from ..subproblems.found import FoundTurn
from ..subproblems.quartic import select
from ..subproblems.sp1 import sp1
from ..subproblems.sp3 import sp3
from ..subproblems.turns import NO_TURN, CosSin, perpendicular, rotated
from ..tasks.partial_poses import (
    DIRECTION,
    PITCH,
    POSITION,
    position,
    position_direction,
    position_pitch,
    tool_axis,
    tool_origin,
)
from ..tasks.task import Solved, Task
from .family import Family

_ARM = 4
"""Number of joints up to the last of those that move the tool in the plane of the arm."""


def _requires(lines: Lines) -> list[Requirement]:
    return [
        revolute(lines, range(len(lines.axes))),
        parallel(lines, 1, 2, 3),
        *_across_parallel(lines, 1),
    ]


def _requires_slide(lines: Lines) -> list[Requirement]:
    turning = [k for k in range(1, _ARM) if lines.axes[k].turns]
    sliding = [k for k in range(1, _ARM) if not lines.axes[k].turns]
    fits = len(sliding) == 1
    count = Requirement("of joints 2, 3 and 4 alone one slides", 0.0 if fits else np.inf)
    ends = [revolute(lines, [k]) for k in (0, *range(_ARM, len(lines.axes)))]
    if not fits or any(end.deviation for end in ends):
        return [count, *ends]
    first = turning[0]
    return [
        *(count, *ends),
        parallel(lines, *turning),
        across(lines, sliding[0], first),
        *_across_parallel(lines, first),
    ]


def _across_parallel(lines: Lines, first: int) -> list[Requirement]:
    ends = (0, *range(_ARM, len(lines.axes)))
    return [across(lines, k, first) for k in ends]


def _in_plane(lines: Lines) -> tuple[Axis, ...]:
    """The parallel axes."""
    return tuple(axis for axis in lines.axes[1:_ARM] if axis.turns)


def _solve(work: Work, lines: Lines, target: Target) -> None:
    terms = work.terms
    a1, a2 = lines.axes[0], _in_plane(lines)[0]
    fifth = lines.axes[_ARM:]
    # 1. The arm moves in a plane.
    carried = fifth[0].p if fifth else target.home
    meaning = f"a point of axis {fifth[0].name}" if fifth else "the tool's origin"
    wanted = work.name_vector(("W", "V"), meaning, target.point(terms, carried))
    e = fifth[0].h if fifth else _across(lines)
    if fifth:
        after = target.turned(terms, e)
        U, q1 = turn_to_direction(work, lines, a2, (carried, wanted), (e, after))
    else:
        U, q1 = _turned_with(work, lines, wanted, target)
    # 2. The parallel axes turn a direction that the last joint does not.
    v = rotated(terms, a1.h, q1.back, target.turned(terms, e))
    total = _sum(work, lines, sp1(terms, a2.h, e, v), "the tool's direction in the arm's plane")
    # 3. A triangle.
    _arm(work, lines, carried, U, total)
    # 4. The rest of the rotation.
    for axis in fifth:
        across_it = cross(terms, axis.h, a2.h)
        left = rotated(terms, a1.h, q1.back, target.turned(terms, across_it))
        left = rotated(terms, a2.h, total.back, left)
        work.step(
            [axis], "subproblem 1", "the rest of the rotation", sp1(terms, axis.h, across_it, left)
        )


def _turned_with(work: Work, lines: Lines, wanted: Vector, target: Target) -> tuple[Vector, CosSin]:
    """:func:`_turned_to` where the tool carries axis 2."""
    terms, a1, a2 = work.terms, lines.axes[0], _in_plane(lines)[0]
    q1 = work.step(
        [a1],
        "subproblem 1",
        f"the other joints do not turn axis {a2.name}",
        sp1(terms, a1.h, a2.h, target.turned(terms, a2.h)),
    )
    return seen_behind(work, a1, a2, subtracted(terms, wanted, a1.p), q1), q1


def _keeps_position(robot: Robot, lines: Lines) -> bool:
    """Whether a fifth joint, if there is one, leaves the tool's origin where it is."""
    return len(lines.axes) <= _ARM or bool(_off(robot, lines, _ARM)[0] < TOOL_ON_AXIS)


def _has_pitch(robot: Robot, lines: Lines) -> bool:
    """Whether axis 1 is the base's third axis, above whose normal plane the elevation counts.

    The tool's axis has to move in the plane of the arm, and about itself with a fifth joint.
    """
    if abs(float(lines.axes[0].direction[2])) < 1 - TOOL_ON_AXIS:
        return False
    if len(lines.axes) > _ARM:
        return max(_off(robot, lines, _ARM)) < TOOL_ON_AXIS
    return abs(float(_home(robot, lines)[:3, 2] @ _in_plane(lines)[0].direction)) < TOOL_ON_AXIS


def _has_direction(robot: Robot, lines: Lines) -> bool:
    """Whether the parallel joints turn the tool's axis, which a fifth joint turns about itself."""
    if len(lines.axes) > _ARM:
        return max(_off(robot, lines, _ARM)) < TOOL_ON_AXIS
    return _off(robot, lines, lines.axes.index(_in_plane(lines)[0]))[1] > OBLIQUE_AXES


def _off(robot: Robot, lines: Lines, k: int) -> tuple[float, float]:
    """The distance of the tool's origin from an axis, and the sine of its axis's angle with it."""
    axis, home = lines.axes[k], _home(robot, lines)
    lever = np.cross(axis.direction, home[:3, 3] - axis.origin)
    tilt = np.cross(axis.direction, home[:3, 2])
    return float(np.linalg.norm(lever)), float(np.linalg.norm(tilt))


def _home(robot: Robot, lines: Lines) -> NDArray[np.float64]:
    return np.array([numbers(lines.terms, row) for row in home_of(robot, lines.terms).tolist()])


def _with_position(robot: Robot, lines: Lines) -> Solved:
    """The tool's position. Joint 4 stays at 0 where the others reach it, else it bends least."""
    terms, (_, a2, a3, a4, *_) = lines.terms, lines.axes
    work = Work(terms)
    tool = tool_origin(robot, terms)
    U, _ = _turned_to(work, lines, tool, POSITION)
    hand = tool
    if _off(robot, lines, _ARM - 1)[0] < TOOL_ON_AXIS:
        work.turns[a4.joint] = NO_TURN
    else:
        lever = subtracted(terms, tool, a4.p)
        bent = work.step(
            [a4],
            "subproblem 3",
            "the hand's distance from the elbow has to fit the triangle",
            _bent_least(terms, lines, lever, U),
            "where the distance fits with this joint at 0, it stays there",
        )
        hand = added(terms, a4.p, rotated(terms, a4.h, bent, lever))
    triangle(work, a2, a3, hand, U)
    _leave(work, lines, _ARM)
    return position(robot, work)


def _bent_least(terms: Terms, lines: Lines, lever: Vector, U: Vector) -> FoundTurn:
    """The turn of joint 4 nearest to 0 with which upper arm and forearm reach the position.

    Shoulder, elbow and hand form a triangle where the hand's distance from the elbow lies between
    difference and sum of the other two sides; the one nearest to that at 0 is taken.
    """
    let, (_, a2, a3, a4, *_) = terms.let, lines.axes
    fore, hand, upper, way = (
        perpendicular(terms, a2.h, v)
        for v in (subtracted(terms, a4.p, a3.p), lever, subtracted(terms, a3.p, a2.p), U)
    )
    r, a, straight = (
        let(sp.sqrt(dot(terms, v, v))) for v in (way, upper, added(terms, fore, hand))
    )
    least, most = let(sp.Abs(let(r - a))), let(r + a)
    length = let(sp.Max(least, sp.Min(straight, most, evaluate=False), evaluate=False))
    found = sp3(terms, a4.h, fore, hand, let(length**2), sp.Integer(1))
    stays = sp.And(straight >= least, straight <= most)
    turn = CosSin(
        select(terms, stays, sp.Integer(1), found.turn.c),
        select(terms, stays, sp.Integer(0), found.turn.s),
    )
    return FoundTurn(turn, found.equation)


def _with_pitch(robot: Robot, lines: Lines) -> Solved:
    """Position and elevation of the tool's axis over the base's x-y plane."""
    terms, a2 = lines.terms, _in_plane(lines)[0]
    work = Work(terms)
    tool, axis = tool_origin(robot, terms), tool_axis(robot, terms)
    pitch = CosSin(*terms.cos_sin(PITCH))
    U, _ = _turned_to(work, lines, tool, POSITION)
    # The tool may point away from axis 1 or towards it.
    sign = work.sign()
    _, _, up = IDENTITY
    outward = cross(terms, a2.h, up)
    wanted = combination(terms, (terms.let(sign * pitch.c), pitch.s), (outward, up))
    found = sp1(terms, a2.h, axis, wanted)
    found = FoundTurn(found.turn, found.equation, sign)
    total = _sum(work, lines, found, "the pitch, with the tool pointing outward or inward")
    _arm(work, lines, tool, U, total)
    _leave(work, lines, _ARM)
    return position_pitch(robot, work, up, pitch)


def _with_direction(robot: Robot, lines: Lines) -> Solved:
    """Position and direction of the tool's axis."""
    terms, a1, a2 = lines.terms, lines.axes[0], _in_plane(lines)[0]
    work = Work(terms)
    tool, axis = tool_origin(robot, terms), tool_axis(robot, terms)
    U, q1 = turn_to_direction(work, lines, a2, (tool, POSITION), (axis, DIRECTION))
    v = rotated(terms, a1.h, q1.back, DIRECTION)
    total = _sum(work, lines, sp1(terms, a2.h, axis, v), "the tool's direction in the arm's plane")
    _arm(work, lines, tool, U, total)
    _leave(work, lines, _ARM)
    return position_direction(robot, work)


def _turned_to(
    work: Work, lines: Lines, carried: Vector, position: Vector
) -> tuple[Vector, CosSin]:
    """Turns the plane of the arm to a position; returns it seen from axis 2, and the turn."""
    a1, a2 = lines.axes[0], _in_plane(lines)[0]
    reason = "the other joints move the point in the plane of the arm"
    return turn_to_plane(work, a1, a2, carried, position, reason)


def _sum(work: Work, lines: Lines, found: FoundTurn, reason: str) -> CosSin:
    return work.step(_in_plane(lines), "subproblem 1", reason, found)


def _arm(work: Work, lines: Lines, carried: Vector, U: Vector, total: CosSin) -> None:
    """The joints that move the tool in the plane of the arm, from the sum of their angles."""
    terms, turning = work.terms, _in_plane(lines)
    if len(turning) < len(lines.axes[1:_ARM]):
        telescope(work, lines.axes[1:_ARM], carried, U, total)
    else:
        a2, a3, a4 = turning
        lever = rotated(terms, a2.h, total, subtracted(terms, carried, a4.p))
        triangle(work, a2, a3, a4.p, subtracted(terms, U, lever))
    remaining(work, turning, total)


def _leave(work: Work, lines: Lines, first: int) -> None:
    """Leaves joints that the task does not determine at 0."""
    for axis in lines.axes[first:]:
        work.turns[axis.joint] = NO_TURN


def _across(lines: Lines) -> Vector:
    """The part of axis 1 perpendicular to the parallel axes."""
    a1, a2 = lines.axes[0], _in_plane(lines)[0]
    return perpendicular(lines.terms, a2.h, a1.h)


TURNTABLE = Family(
    "a turntable with three parallel axes",
    (4, 5),
    _requires,
    _solve,
    tasks=(
        Task("ik_position", _with_position, _keeps_position),
        Task("ik_position_pitch", _with_pitch, _has_pitch),
        Task("ik_position_direction", _with_direction, _has_direction),
    ),
)

TELESCOPE = Family(
    "a turntable with two parallel axes and a slide across them",
    (4, 5),
    _requires_slide,
    _solve,
    rather_gives=True,
    tasks=(
        Task("ik_position_pitch", _with_pitch, _has_pitch),
        Task("ik_position_direction", _with_direction, _has_direction),
    ),
)
