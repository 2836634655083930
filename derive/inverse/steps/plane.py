"""The first step of an arm behind a turntable: the angle that turns its plane to a point."""

import sympy as sp

from ...terms.vectors import Vector, added, dot, subtracted
from ..structure.lines import Axis, Lines
from ..subproblems.sp4 import sp4
from ..subproblems.turns import CosSin, rotated
from ..subproblems.two_lines import EQUATIONS, component, of_two_lines
from .work import Work

DIGITS = 20
"""Digits of the arm's length, which serves as a scale."""


def turn_to_plane(
    work: Work, first: Axis, second: Axis, carried: Vector, position: Vector, reason: str
) -> tuple[Vector, CosSin]:
    """Finds the first joint's angle where no other joint moves a point along the second axis.

    Args:
        work: Gathers the step.
        first: The axis of this joint.
        second: The axis along which only the first joint moves the point.
        carried: The point in the home pose.
        position: The wanted position of the point.
        reason: Why no other joint moves the point along the second axis, in words.

    Returns:
        The wanted position turned back by the first joint, relative to the second axis, and the
        joint's turn.
    """
    terms = work.terms
    V = subtracted(terms, position, first.p)
    d = dot(terms, second.h, subtracted(terms, carried, first.p))
    turn = work.step(
        [first],
        "subproblem 4",
        reason,
        sp4(terms, V, first.h, second.h, d, work.sign()),
        "with the point on the first axis the angle is arbitrary and taken as 0",
    )
    return seen_behind(work, first, second, V, turn), turn


def turn_to_direction(
    work: Work,
    lines: Lines,
    second: Axis,
    point: tuple[Vector, Vector],
    direction: tuple[Vector, Vector],
) -> tuple[Vector, CosSin]:
    """:func:`turn_to_plane` where a direction that the tool carries determines joint 1, too.

    The next joints turn about parallel axes or slide across them, and keep the angle of the
    direction with these axes.

    Args:
        work: Gathers the step.
        lines: The chain, whose first joint this is.
        second: The axis to which those of the next joints that turn are parallel.
        point: The point in the home pose, and its wanted position.
        direction: The direction in the home pose, and the wanted one (unit vectors).

    Returns:
        As :func:`turn_to_plane`.
    """
    terms, first = work.terms, lines.axes[0]
    (carried, wanted), (before, after) = point, direction
    V = subtracted(terms, wanted, first.p)
    height = dot(terms, second.h, subtracted(terms, carried, first.p))
    k = first.reversed().h
    # Near the axis, V is a difference of positions as large as the arm.
    size2 = terms.let(dot(terms, V, V) + sp.Float(lines.length**2, DIGITS))
    turn = work.step(
        [first],
        EQUATIONS,
        f"the other joints keep the height of the point along axis {second.name}, and the angle of "
        "the direction with this axis",
        of_two_lines(
            terms,
            component(terms, second.h, k, V, height, size2),
            component(terms, second.h, k, after, dot(terms, second.h, before)),
            work.sign(),
        ),
    )
    return seen_behind(work, first, second, V, turn), turn


def seen_behind(work: Work, first: Axis, second: Axis, V: Vector, turn: CosSin) -> Vector:
    """A position relative to the first axis, turned back and relative to the second axis."""
    terms = work.terms
    seen = rotated(terms, first.h, turn.back, V)
    return added(terms, seen, subtracted(terms, first.p, second.p))
