"""One angle from two equations that are linear in its cosine and sine.

Statement: ``a cos + b sin = e`` and ``a' cos + b' sin = e'``, where an angle is asked for that
meets both: a chain with fewer joints than the task has conditions.

Derivation: each equation is subproblem 4 and gives two angles, of which the wanted one is common.
An equation's two angles are known to ``rounding / sin(half their difference)``, to the root of the
rounding where they are one, and not at all where a = b = 0. So the equation is taken whose angles
lie farther apart, measured by its terms: where they are one, the longer equation. The angles of the
second equation are named by those of the first: the sign 1 belongs to the one that is nearer to the
first equation's angle of the sign 1.

Degenerate: where both equations have a double solution it is known to 1e-8 only, and where all
coefficients are 0 the angle is arbitrary and taken as 0.

Source: elementary.
"""

from dataclasses import dataclass

import sympy as sp

from ...model.tolerances import DIVISOR_FLOOR, MEETING_SOLUTIONS
from ...terms.terms import Terms
from ...terms.vectors import Vector, cross, dot
from .equations import Linear
from .found import FoundTurn
from .quartic import select
from .sp4 import on_line
from .turns import CosSin, perpendicular

EQUATIONS = "two equations for one angle"
"""The subproblem in the words of a step."""


@dataclass(frozen=True)
class Line:
    """``a cos + b sin = e``, with the squared size of the terms that e is made of."""

    a: sp.Expr
    b: sp.Expr
    e: sp.Expr
    size2: sp.Expr

    @property
    def is_empty(self) -> bool:
        """Whether the equation does not contain the angle."""
        return bool(self.a == 0 and self.b == 0)


def component(
    terms: Terms, h: Vector, k: Vector, p: Vector, d: sp.Expr, size2: sp.Expr | None = None
) -> Line:
    """The equation ``h . R(k, theta) p = d`` of subproblem 4.

    Args:
        terms: Names of all terms.
        h: The direction.
        k: The axis.
        p: The vector that turns.
        d: Its component.
        size2: The squared size of the terms that p is a difference of; by default that of p.
    """
    along = terms.let(dot(terms, h, k) * dot(terms, k, p))
    size2 = dot(terms, p, p) if size2 is None else size2
    size2 = terms.let(dot(terms, h, h) * size2 + d**2)
    a, b = dot(terms, h, perpendicular(terms, k, p)), dot(terms, h, cross(terms, k, p))
    return Line(a, b, terms.let(d - along), size2)


def of_two_lines(terms: Terms, one: Line, two: Line, sign: sp.Symbol) -> FoundTurn:
    """The angle that meets both equations, from the one that determines it better.

    Args:
        terms: Names of all terms.
        one: The first equation.
        two: The second.
        sign: Chooses among the two angles of an equation.
    """
    if one.is_empty or two.is_empty:
        return _alone(terms, one if two.is_empty else two, sign)
    apart2, other_apart2 = (_apart2(terms, line) for line in (one, two))
    better = terms.let(other_apart2 * terms.let(one.size2 + DIVISOR_FLOOR)) > terms.let(
        apart2 * terms.let(two.size2 + DIVISOR_FLOOR)
    )
    named = _alone(terms, one, sp.Integer(1)).turn
    first = _alone(terms, one, sign)
    side = terms.let(two.a * named.s - two.b * named.c)
    flip = select(terms, side >= 0, sp.Integer(1), sp.Integer(-1))
    second = _alone(terms, two, terms.let(sign * flip))
    turn = CosSin(
        select(terms, better, second.turn.c, first.turn.c),
        select(terms, better, second.turn.s, first.turn.s),
    )
    margins = [sp.Integer(1) if of.margin is None else of.margin for of in (first, second)]
    margin = select(terms, better, margins[1], margins[0])
    return FoundTurn(turn, first.equation, sign, margin)


def _apart2(terms: Terms, line: Line) -> sp.Expr:
    """The squared sine of half the difference of a line's two angles, times ``a^2 + b^2``."""
    rho2 = terms.let(line.a**2 + line.b**2)
    least = terms.let(MEETING_SOLUTIONS * rho2)
    return terms.let(sp.Max(terms.let(rho2 - line.e**2), least, evaluate=False))


def _alone(terms: Terms, line: Line, sign: sp.Expr) -> FoundTurn:
    """Subproblem 4 of one of the equations."""
    xi2 = terms.let(line.a**2 + line.b**2 - line.e**2)
    found = on_line(terms, line.a, line.b, line.e, sign, xi2)
    return FoundTurn(found.turn, Linear(line.a, line.b, line.e), sign, found.margin)
