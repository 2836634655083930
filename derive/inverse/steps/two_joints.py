"""Two joints that bring a point to a position: an arm whose first joint stays where it is.

Two joints cannot reach every position; for one that they reach the steps give the joints, for any
other a position nearby. Of the two conditions that the second joint has to meet, the one is taken
that determines it better.
"""

import sympy as sp

from ...model.tolerances import OBLIQUE_AXES
from ...terms.vectors import Vector, added, combination, dot, subtracted
from ..structure.lines import Axis
from ..subproblems.slides import slide_to_plane, slide_to_sphere
from ..subproblems.sp1 import sp1
from ..subproblems.turns import perpendicular, rotated
from ..subproblems.two_lines import EQUATIONS, component, of_two_lines
from .three_joints import two_slides
from .work import Work


def two_joints(work: Work, first: Axis, second: Axis, point: Vector, position: Vector) -> None:
    """Finds two joints with ``exp(S_1 q_1) exp(S_2 q_2) point = position``.

    Args:
        work: Gathers the steps.
        first: The axis of the first joint.
        second: The axis of the second joint.
        point: The point in the home pose.
        position: Its wanted position.
    """
    if first.turns and second.turns:
        reach = subtracted(work.terms, point, second.p)
        offset = subtracted(work.terms, second.p, first.p)
        second_turn(work, first, second, offset, reach, subtracted(work.terms, position, first.p))
    elif first.turns:
        _turn_and_slide(work, first, second, point, position)
    elif second.turns:
        _slide_and_turn(work, first, second, point, position)
    else:
        two_slides(work, first, second, subtracted(work.terms, position, point))


def second_turn(
    work: Work, first: Axis, second: Axis, offset: Vector, reach: Vector, wanted: Vector
) -> None:
    """Finds two turns with ``R_1 (offset + R_2 reach) = wanted``.

    The first turn changes neither the component along its axis nor the length.
    """
    terms = work.terms
    length2 = dot(terms, offset, offset)
    by_length = terms.let(
        (dot(terms, wanted, wanted) - terms.let(length2 + dot(terms, reach, reach))) / 2
    )
    by_height = terms.let(dot(terms, first.h, wanted) - dot(terms, first.h, offset))
    turn = work.step(
        [second],
        EQUATIONS,
        f"{first.name} keeps the point's distance from its axis, and its height along the axis",
        of_two_lines(
            terms,
            component(terms, offset, second.h, reach, by_length),
            component(terms, first.h, second.h, reach, by_height),
            work.sign(),
        ),
    )
    there = added(terms, offset, rotated(terms, second.h, turn, reach))
    _point(work, first, there, wanted)


def _point(work: Work, axis: Axis, there: Vector, wanted: Vector) -> None:
    work.step(
        [axis],
        "subproblem 1",
        "the rest of the way to the position",
        sp1(work.terms, axis.h, there, wanted),
        "with the position on the axis the angle is arbitrary and taken as 0",
    )


def _turn_and_slide(work: Work, first: Axis, second: Axis, point: Vector, wanted: Vector) -> None:
    terms = work.terms
    U, reach = subtracted(terms, wanted, first.p), subtracted(terms, point, first.p)
    length = _slide_off(work, second, first, reach, U)
    there = combination(terms, (sp.Integer(1), length), (reach, second.h))
    _point(work, first, there, U)


def _slide_and_turn(work: Work, first: Axis, second: Axis, point: Vector, wanted: Vector) -> None:
    terms = work.terms
    back = first.reversed()
    V, reach = subtracted(terms, wanted, second.p), subtracted(terms, point, second.p)
    length = _slide_off(work, back, second, V, reach)
    _point(work, second, reach, combination(terms, (sp.Integer(1), length), (V, back.h)))


def _slide_off(work: Work, slide: Axis, turning: Axis, point: Vector, other: Vector) -> sp.Expr:
    """The slide that gives a point the height along an axis, or the distance from it, of another.

    Both are positions relative to the axis, which turns the one into the other.
    """
    terms = work.terms
    if abs(float(slide.direction @ turning.direction)) > OBLIQUE_AXES:
        return work.slide(
            slide,
            "a line meets a plane",
            f"{turning.name} does not move the point along its axis",
            slide_to_plane(terms, turning.h, slide.h, point, dot(terms, turning.h, other)),
        )
    across = perpendicular(terms, turning.h, other)
    return work.slide(
        slide,
        "a line meets a sphere",
        f"{turning.name} keeps the point's distance from its axis",
        slide_to_sphere(
            terms,
            slide.h,
            perpendicular(terms, turning.h, point),
            dot(terms, across, across),
            work.sign(),
        ),
    )
