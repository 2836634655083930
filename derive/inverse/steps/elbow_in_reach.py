"""Selects an angle sum of three parallel joints that the tool orientation does not determine."""

import sympy as sp

from ...model.tolerances import UNDETERMINED_SUM
from ...terms.vectors import Vector, dot, subtracted
from ..structure.lines import Lines
from ..subproblems.found import FoundTurn
from ..subproblems.sp3 import by_cosine
from ..subproblems.turns import CosSin, perpendicular
from .work import Work


def with_elbow_in_reach(
    work: Work,
    lines: Lines,
    found: FoundTurn,
    v: Vector,
    U: Vector,
    center: Vector,
    sign: sp.Symbol,
) -> FoundTurn:
    """Return the sum of joint angles 2 to 4.

    If the tool orientation does not determine this sum, the sum is selected so that the elbow angle
    is as close to 90 degrees as possible.

    Args:
        work: Object that records the solution steps.
        lines: The chain.
        found: The sum of angles 2 to 4, computed from the direction of axis 6.
        v: The target direction of axis 6, rotated back by joint 1.
        U: The target wrist position relative to axis 2, rotated back by joint 1.
        center: The wrist position with joints 1 to 4 at 0.
        sign: Selects one of two values for the sum of angles 2 to 4.
    """
    terms = work.terms
    _, a2, a3, a4, _, _ = lines.axes
    lever = perpendicular(terms, a2.h, subtracted(terms, center, a4.p))
    minus_U = subtracted(terms, (sp.Integer(0),) * 3, perpendicular(terms, a2.h, U))
    upper = perpendicular(terms, a2.h, subtracted(terms, a3.p, a2.p))
    fore = perpendicular(terms, a2.h, subtracted(terms, a4.p, a3.p))
    right = terms.let(dot(terms, upper, upper) + dot(terms, fore, fore))
    best = by_cosine(terms, a2.h, minus_U, lever, right, sign)
    across = perpendicular(terms, a2.h, v)
    is_determined = dot(terms, across, across) > terms.let(UNDETERMINED_SUM**2)
    turn = CosSin(
        terms.let(sp.Piecewise((found.turn.c, is_determined), (best.c, True), evaluate=False)),
        terms.let(sp.Piecewise((found.turn.s, is_determined), (best.s, True), evaluate=False)),
    )
    return FoundTurn(turn, found.equation, found.sign, found.margin)
