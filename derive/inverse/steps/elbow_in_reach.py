"""The sum of three parallel joints' angles where the tool's orientation leaves it undetermined."""

import sympy as sp

from ...model.tolerances import UNDETERMINED_SUM
from ...terms.vectors import Vector, dot, subtracted
from ..structure.lines import Lines
from ..subproblems.found import FoundTurn
from ..subproblems.sp3 import sp3
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
    """The sum of angles 2 to 4, and where v does not tell it the one that the elbow likes best.

    Args:
        work: Names of all terms.
        lines: The chain.
        found: The sum as axis 6 tells it.
        v: Axis 6 as joint 1 leaves it.
        U: The hand's place as joint 1 leaves it, seen from axis 2.
        centre: The hand, with joints 1 to 4 at 0.
        sign: Chooses among two sums that the elbow likes equally.
    """
    terms = work.terms
    _, a2, a3, a4, _, _ = lines.axes
    lever = perpendicular(terms, a2.h, subtracted(terms, centre, a4.p))
    minus_U = subtracted(terms, (sp.Integer(0),) * 3, perpendicular(terms, a2.h, U))
    upper = perpendicular(terms, a2.h, subtracted(terms, a3.p, a2.p))
    fore = perpendicular(terms, a2.h, subtracted(terms, a4.p, a3.p))
    right = terms.let(dot(terms, upper, upper) + dot(terms, fore, fore))
    best = sp3(terms, a2.h, minus_U, lever, right, sign).turn
    across = perpendicular(terms, a2.h, v)
    told = dot(terms, across, across) > terms.let(UNDETERMINED_SUM**2)
    turn = CosSin(
        terms.let(sp.Piecewise((found.turn.c, told), (best.c, True), evaluate=False)),
        terms.let(sp.Piecewise((found.turn.s, told), (best.s, True), evaluate=False)),
    )
    return FoundTurn(turn, found.equation, found.sign, found.margin)
