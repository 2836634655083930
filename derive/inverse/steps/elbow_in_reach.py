"""The sum of three parallel joints' angles where the tool's orientation leaves it undetermined."""

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
    centre: Vector,
    sign: sp.Symbol,
) -> FoundTurn:
    """The sum of angles 2 to 4; where v does not determine it, the sum that bends the elbow best.

    The best bend is the nearest to a right angle.

    Args:
        work: Names of all terms.
        lines: The chain.
        found: The sum that follows from the direction of axis 6.
        v: The wanted direction of axis 6, turned back by joint 1.
        U: The wanted position of the hand relative to axis 2, turned back by joint 1.
        centre: The hand, with joints 1 to 4 at 0.
        sign: Chooses among two sums that bend the elbow equally.
    """
    terms = work.terms
    _, a2, a3, a4, _, _ = lines.axes
    lever = perpendicular(terms, a2.h, subtracted(terms, centre, a4.p))
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
