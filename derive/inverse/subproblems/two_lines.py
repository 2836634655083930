"""Two equations that are linear in the cosine and sine of one angle.

Statement: The equations ``a cos + b sin = e`` and ``a' cos + b' sin = e'`` are solved for an angle
that satisfies both. These equations occur in chains with fewer joints than task equations.

Derivation: subproblem 4 gives two solutions for each equation. Of these solutions, the angle that
solves both equations is selected. Let delta be the difference between the two solutions of an
equation. The error of a solution is the rounding error of the equation, divided by sin(delta / 2).
For a double solution, the error is the square root of the rounding error. If a = b = 0, the
equation ``a cos + b sin = e`` does not determine the angle. Therefore, each equation is rated by
the difference between its two solutions, relative to the terms of the equation. The angle is
computed from the equation with the higher rating. If both equations have a double solution, the
equation with the larger coefficients is used. For the second equation, sign 1 selects the solution
nearer to the solution that sign 1 selects for the first equation.

Degenerate: if both equations have a double solution, the accuracy of the angle is 1e-8. If all
coefficients are 0, the angle is arbitrary and set to 0.

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
"""Name of the subproblem in descriptions of solution steps."""


@dataclass(frozen=True)
class Line:
    """The equation ``a cos + b sin = e``, with squared magnitude ``size2`` of the terms in e."""

    a: sp.Expr
    b: sp.Expr
    e: sp.Expr
    size2: sp.Expr

    @property
    def is_empty(self) -> bool:
        """Whether a and b are 0, so that the equation does not contain the angle."""
        return bool(self.a == 0 and self.b == 0)


def component(
    terms: Terms, h: Vector, k: Vector, p: Vector, d: sp.Expr, size2: sp.Expr | None = None
) -> Line:
    """Return the equation ``h.(R(k, theta) p) = d`` in the form ``a cos + b sin = e``.

    Args:
        terms: Table of named terms.
        h: The direction.
        k: The axis.
        p: The rotated vector.
        d: The required component of ``R(k, theta) p`` along h.
        size2: Squared magnitude of the terms whose difference is p, by default the squared length
            of p.
    """
    along = terms.let(dot(terms, h, k) * dot(terms, k, p))
    size2 = dot(terms, p, p) if size2 is None else size2
    size2 = terms.let(dot(terms, h, h) * size2 + d**2)
    a, b = dot(terms, h, perpendicular(terms, k, p)), dot(terms, h, cross(terms, k, p))
    return Line(a, b, terms.let(d - along), size2)


def of_two_lines(terms: Terms, one: Line, two: Line, sign: sp.Symbol) -> FoundTurn:
    """Solve the better conditioned of two equations for their common angle.

    Args:
        terms: Table of named terms.
        one: The first equation.
        two: The second equation.
        sign: Selects one of the two solutions of an equation.
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
    """Return ``(a^2 + b^2) sin^2(delta / 2)``, where the two solutions differ by delta."""
    rho2 = terms.let(line.a**2 + line.b**2)
    least = terms.let(MEETING_SOLUTIONS * rho2)
    return terms.let(sp.Max(terms.let(rho2 - line.e**2), least, evaluate=False))


def _alone(terms: Terms, line: Line, sign: sp.Expr) -> FoundTurn:
    xi2 = terms.let(line.a**2 + line.b**2 - line.e**2)
    found = on_line(terms, line.a, line.b, line.e, sign, xi2)
    return FoundTurn(found.turn, Linear(line.a, line.b, line.e), sign, found.margin)
