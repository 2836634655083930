"""Selects arm joint angles that the position of the wrist center does not determine.

If the wrist center lies on the axis of an arm joint, the position of the wrist center does not
determine the angle of this joint. If axis 5 is perpendicular to axes 4 and 6, the wrist reaches
every orientation, so any angle of the arm joint is valid. For a wrist with oblique axes, the
selected arm joint angle brings the angle between axes 4 and 6 closest to the middle of its range.
"""

import sympy as sp

from ...model.tolerances import EXACT_STRUCTURE, UNDETERMINED_TURN
from ...terms.terms import Terms
from ...terms.vectors import Vector, added, combination, dot, subtracted
from ..structure.lines import Axis, Lines
from ..subproblems.quartic import select
from ..subproblems.sp4 import sp4
from ..subproblems.turns import CosSin, perpendicular, rotated
from .target import Target
from .work import Work


def with_wrist_in_reach(
    work: Work, lines: Lines, center: Vector, position: Vector, target: Target
) -> None:
    """Select the angles of joints 1 to 3 if the wrist center does not determine them.

    Args:
        work: Object that records the solution steps. Joints 1 to 3 are solved.
        lines: The six-joint chain, whose last three joints are the wrist.
        center: The wrist center in the home pose.
        position: The target position of the wrist center.
        target: The pose that the chain must reach.
    """
    *_, a4, a5, a6 = lines.axes
    terms = work.terms
    if a6.stays:
        # The angle between axes 5 and 4 is constant.
        wanted, cosine, sign = target.turned(terms, a5.h), dot(terms, a4.h, a5.h), work.sign()
    elif is_straight(a4, a5) and is_straight(a5, a6):
        return
    else:
        wanted = target.turned(terms, a6.h)
        cosine = terms.let(dot(terms, a4.h, a5.h) * dot(terms, a5.h, a6.h))
        sign = sp.Integer(1)
    with_angle_to_axis(work, lines, center, position, (wanted, cosine), sign)


def with_angle_to_axis(
    work: Work,
    lines: Lines,
    center: Vector,
    position: Vector,
    best: tuple[Vector, sp.Expr],
    sign: sp.Expr,
) -> None:
    """Select the angles of joints 1 to 3 that the wrist center does not determine.

    If possible, the selected joint angles give a preferred angle between axis 4 and a given
    direction.

    Args:
        work: Object that records the solution steps. Joints 1 to 3 are solved.
        lines: The chain, in which axis 4 is the first axis of the wrist.
        center: The wrist center in the home pose.
        position: The target position of the wrist center.
        best: A direction in the target pose, and the preferred cosine of the angle between this
            direction and axis 4.
        sign: Selects one of two solutions for an undetermined joint angle.
    """
    a1, a2, a3, a4, *_ = lines.axes
    terms, (wanted, cosine) = work.terms, best
    if a3.turns:
        seen = _turned(terms, work, (a1, a2), wanted, back=True)
        lever = subtracted(terms, center, a3.p)
        _choose(work, a3, lever, sp4(terms, seen, a3.h, a4.h, cosine, sign).turn)
    if a1.turns and not a1.stays:
        later = _turned(terms, work, (a2, a3), a4.h)
        lever = subtracted(terms, position, a1.p)
        _choose(work, a1, lever, sp4(terms, wanted, a1.h, later, cosine, sign).turn)
    if a2.turns:
        seen = _turned(terms, work, (a1,), wanted, back=True)
        later = _turned(terms, work, (a3,), a4.h)
        lever = subtracted(terms, _moved(terms, work, a3, center), a2.p)
        _choose(work, a2, lever, sp4(terms, seen, a2.h, later, cosine, sign).turn)


def _choose(work: Work, axis: Axis, lever: Vector, best: CosSin) -> None:
    work.turns[axis.joint] = where_free(work.terms, axis.h, lever, work.turns[axis.joint], best)


def where_free(terms: Terms, k: Vector, lever: Vector, found: CosSin, best: CosSin) -> CosSin:
    """Return the angle ``best`` if the lever arm is parallel to the axis k, else ``found``."""
    if all(map(terms.is_constant, lever)):
        return found
    across = perpendicular(terms, k, lever)
    is_free = dot(terms, across, across) <= terms.let(UNDETERMINED_TURN**2)
    return CosSin(select(terms, is_free, best.c, found.c), select(terms, is_free, best.s, found.s))


def is_straight(one: Axis, other: Axis) -> bool:
    """Whether two axes are perpendicular."""
    return abs(float(one.direction @ other.direction)) <= EXACT_STRUCTURE


def _turned(
    terms: Terms, work: Work, axes: tuple[Axis, ...], v: Vector, *, back: bool = False
) -> Vector:
    for axis in axes if back else axes[::-1]:
        if axis.turns:
            turn = work.turns[axis.joint]
            v = rotated(terms, axis.h, turn.back if back else turn, v)
    return v


def _moved(terms: Terms, work: Work, axis: Axis, point: Vector) -> Vector:
    if not axis.turns:
        return combination(terms, (sp.Integer(1), work.lengths[axis.joint]), (point, axis.h))
    lever = subtracted(terms, point, axis.p)
    return added(terms, axis.p, rotated(terms, axis.h, work.turns[axis.joint], lever))
