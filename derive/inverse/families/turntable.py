"""One joint that turns an arm of three parallel axes, and perhaps one that turns the tool.

Axis 1, then axes 2, 3 and 4 parallel, then at most one more: four joints move the tool in four ways
(place, and pitch in the plane of the arm), a fifth turns it about an axis of that plane. A pose has
six numbers; one that such an arm cannot have is answered by what these steps make of it, and its
residual tells.

Most solutions: 4 for a pose; 8 for place and pitch, which the tool may have from either side.
"""

import sympy as sp

from ...terms.vectors import Vector, combination, cross, subtracted
from ..steps.plane import turn_to_plane
from ..steps.target import Target
from ..steps.triangle import remaining, triangle
from ..steps.work import Work
from ..structure.lines import Lines
from ..structure.requirement import Requirement, across, parallel, revolute
from ..subproblems.found import FoundTurn
from ..subproblems.sp1 import sp1
from ..subproblems.turns import Turn, perpendicular, rotated

TITLE = "a turntable with three parallel axes"


def requires(lines: Lines) -> list[Requirement]:
    """What the axes must fulfil."""
    return [
        revolute(lines, range(len(lines.axes))),
        parallel(lines, 1, 2, 3),
        across(lines, 0, 1),
        *([across(lines, 4, 1)] if len(lines.axes) > 4 else []),  # noqa: PLR2004
    ]


def solve(work: Work, lines: Lines, target: Target) -> None:
    """All joints for a pose."""
    terms = work.terms
    a1, a2, *_ = lines.axes
    fifth = lines.axes[4:]
    # 1. The arm moves in a plane.
    carried = fifth[0].p if fifth else target.home
    meaning = f"a point of axis {fifth[0].name}" if fifth else "the tool's origin"
    place = work.call("W", meaning, target.point(terms, carried))
    U, q1 = _turned_to(work, lines, carried, place)
    # 2. The parallel axes turn as one what the last joint leaves alone.
    e = fifth[0].h if fifth else _across(lines)
    v = rotated(terms, a1.h, q1.back, target.turned(terms, e))
    q234 = _sum(work, lines, sp1(terms, a2.h, e, v), "the tool's direction in the arm's plane")
    # 3. A triangle.
    _arm(work, lines, carried, U, q234)
    # 4. What is left of the turn.
    for axis in fifth:
        across_it = cross(terms, axis.h, a2.h)
        left = rotated(terms, a1.h, q1.back, target.turned(terms, across_it))
        left = rotated(terms, a2.h, q234.back, left)
        work.step(
            [axis], "subproblem 1", "what is left of the turn", sp1(terms, axis.h, across_it, left)
        )


def solve_pitch(
    work: Work, lines: Lines, tool: Vector, axis: Vector, place: Vector, pitch: Turn
) -> None:
    """Place and elevation of the tool's axis; the fifth joint is left at 0.

    Args:
        work: Gathers the steps.
        lines: The chain.
        tool: The tool's origin in the home pose.
        axis: The tool's axis in the home pose.
        place: Where the origin is to come.
        pitch: The axis' elevation over the plane across axis 1.
    """
    terms, (a1, a2, *_) = work.terms, lines.axes
    U, _ = _turned_to(work, lines, tool, place)
    # The tool may point away from axis 1 or towards it.
    sign = work.sign()
    outward = cross(terms, a2.h, a1.h)
    wanted = combination(terms, (terms.let(sign * pitch.c), pitch.s), (outward, a1.h))
    found = sp1(terms, a2.h, axis, wanted)
    found = FoundTurn(found.turn, found.equation, sign)
    q234 = _sum(work, lines, found, "the pitch, with the tool pointing outward or inward")
    _arm(work, lines, tool, U, q234)
    _leave(work, lines, 4)


def solve_direction(
    work: Work, lines: Lines, tool: Vector, axis: Vector, place: Vector, wanted: Vector
) -> None:
    """Place and direction of the tool's axis; the fifth joint is left at 0."""
    terms, (a1, a2, *_) = work.terms, lines.axes
    U, q1 = _turned_to(work, lines, tool, place)
    v = rotated(terms, a1.h, q1.back, wanted)
    q234 = _sum(work, lines, sp1(terms, a2.h, axis, v), "the tool's direction in the arm's plane")
    _arm(work, lines, tool, U, q234)
    _leave(work, lines, 4)


def _turned_to(work: Work, lines: Lines, carried: Vector, place: Vector) -> tuple[Vector, Turn]:
    """Turns the plane of the arm to a place; returns it seen from axis 2, and the turn."""
    a1, a2, *_ = lines.axes
    reason = "the other joints move the point in the plane of the arm"
    return turn_to_plane(work, a1, a2, carried, place, reason)


def _sum(work: Work, lines: Lines, found: FoundTurn, reason: str) -> Turn:
    return work.step(lines.axes[1:4], "subproblem 1", reason, found)


def _arm(work: Work, lines: Lines, carried: Vector, U: Vector, q234: Turn) -> None:
    terms, (_, a2, a3, a4, *_) = work.terms, lines.axes
    lever = rotated(terms, a2.h, q234, subtracted(terms, carried, a4.p))
    triangle(work, a2, a3, a4.p, subtracted(terms, U, lever))
    remaining(work, (a2, a3, a4), q234)


def _leave(work: Work, lines: Lines, first: int) -> None:
    """Joints that the task leaves free stay at 0."""
    for axis in lines.axes[first:]:
        work.turns[axis.joint] = Turn(sp.Integer(1), sp.Integer(0))


def _across(lines: Lines) -> Vector:
    """A direction across the parallel axes: that of axis 1."""
    a1, a2, *_ = lines.axes
    return perpendicular(lines.terms, a2.h, a1.h)
