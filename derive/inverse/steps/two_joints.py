"""Solves for two joints that position a point.

Two joints cannot move a point to every position. For an unreachable target position, the joints
move the point to a nearby position. The value of the second joint must satisfy two equations, of
which only the better conditioned equation is solved.
"""

import sympy as sp

from ...model.tolerances import OBLIQUE_AXES
from ...terms.vectors import Vector, added, combination, dot, subtracted
from ..structure.lines import Axis
from ..subproblems.slides import slide_to_plane, slide_to_sphere
from ..subproblems.sp1 import sp1
from ..subproblems.turns import perpendicular, rotated
from ..subproblems.two_lines import EQUATIONS, component, of_two_lines
from .slides import two_slides
from .work import Work


def two_joints(work: Work, first: Axis, second: Axis, point: Vector, position: Vector) -> None:
    """Solve ``exp(S_1 q_1) exp(S_2 q_2) point = position`` for two joints.

    Args:
        work: Records the steps.
        first: The axis of the first joint.
        second: The axis of the second joint.
        point: The point in the home pose.
        position: The target position of the point.
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
    """Solve ``R_1 (offset + R_2 reach) = wanted`` for two rotations R_1 and R_2.

    The rotation R_1 changes neither the length of a vector nor its component along the axis of R_1.
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
        f"{first.name} changes neither the distance from the point to its axis nor the height of "
        "the point along the axis",
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
        "this joint rotates the point to its target position",
        sp1(work.terms, axis.h, there, wanted),
        "if the position is on the axis, the angle is arbitrary and set to 0",
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
    """Solve for a prismatic joint from a point's height along or distance from a revolute axis.

    After the prismatic displacement, the revolute joint rotates ``point`` to ``other``.
    """
    terms = work.terms
    if abs(float(slide.direction @ turning.direction)) > OBLIQUE_AXES:
        return work.slide(
            slide,
            "line-plane intersection",
            f"{turning.name} does not move the point along its axis",
            slide_to_plane(terms, turning.h, slide.h, point, dot(terms, turning.h, other)),
        )
    across = perpendicular(terms, turning.h, other)
    return work.slide(
        slide,
        "line-sphere intersection",
        f"{turning.name} does not change the distance from the point to its axis",
        slide_to_sphere(
            terms,
            slide.h,
            perpendicular(terms, turning.h, point),
            dot(terms, across, across),
            work.sign(),
        ),
    )
