"""Subproblem 4: the angles at which a rotated vector has a given component along another.

Statement: ``h . R(k, theta) p = d``.

Derivation: the left side is ``a cos + b sin + (h . k)(k . p)`` with ``a = h . p'``,
``p' = p - k (k . p)`` and ``b = h . (k x p)``. With ``e = d - (h . k)(k . p)`` the line
``a x + b y = e`` meets the unit circle where

    (x, y) (a^2 + b^2) = e (a, b) +- xi (-b, a),    xi^2 = a^2 + b^2 - e^2.

Out of reach xi is 0 and (x, y) points along e (a, b), the nearest that the circle comes.

Boundary: at xi = 0 both solutions meet. Rounding alone moves xi^2 by some 1e-16 (a^2 + b^2), so
that below MEETING_SOLUTIONS of it the two are one: a solution that rounding has moved off its
singular position by 1e-8 would hide the singularity from the steps behind it, and to meet the line
to 4e-15 of its length costs nothing.

Degenerate: where a = b = 0 the angle is arbitrary and taken as 0; where they vanish by the robot's
dimensions, for every target, e tells whether it can be reached at all, and is no margin.

Source: Elias and Wen 2022, subproblem 4.
"""

import sympy as sp

from ...model.tolerances import DIVISOR_FLOOR, MEETING_SOLUTIONS
from ...terms.terms import Terms
from ...terms.vectors import Vector, cross, dot
from .equations import Linear
from .found import FoundTurn
from .turns import NO_TURN, CosSin, composed, direction, direction_of, perpendicular


def sp4(terms: Terms, h: Vector, k: Vector, p: Vector, d: sp.Expr, sign: sp.Symbol) -> FoundTurn:
    """The turn about the unit vector k after which p has the component d along h (h . R p = d)."""
    a = dot(terms, h, perpendicular(terms, k, p))
    b = dot(terms, h, cross(terms, k, p))
    e = terms.let(d - terms.let(dot(terms, h, k) * dot(terms, k, p)))
    rho2 = terms.let(a**2 + b**2)
    return on_line(terms, a, b, e, sign, terms.let(rho2 - e**2))


def on_line(
    terms: Terms,
    a: sp.Expr,
    b: sp.Expr,
    e: sp.Expr,
    sign: sp.Symbol,
    xi2: sp.Expr,
    are_two: sp.Basic | None = None,
) -> FoundTurn:
    """The intersections of the line ``a cos + b sin = e`` with the unit circle.

    Args:
        terms: Names of all terms.
        a: Its coefficient of the cosine.
        b: Its coefficient of the sine.
        e: The right side.
        sign: Chooses among the two points: the sign of the turn from (a, b) to the point.
        xi2: ``a^2 + b^2 - e^2``, in the form that loses the fewest digits.
        are_two: Whether the points are apart; None where xi2 against a^2 + b^2 tells.
    """
    if a == b == 0:
        return FoundTurn(NO_TURN, Linear(a, b, e), sign)
    if e == 0:
        return _through_centre(terms, a, b, sign)
    middle, rho2, inverse = direction_of(terms, a, b)
    if are_two is None:
        are_two = xi2 > terms.let(MEETING_SOLUTIONS * rho2)
    # As the turn from (a, b): the divisor is known before the root is.
    half = terms.let(sp.sqrt(xi2) * inverse)
    sine = terms.let(sp.Piecewise((half, are_two), (sp.Integer(0), True), evaluate=False))
    nearest = sp.Piecewise((sp.Integer(-1), e < 0), (sp.Integer(1), True), evaluate=False)
    cosine = terms.let(
        sp.Piecewise((terms.let(e * inverse), are_two), (terms.let(nearest), True), evaluate=False)
    )
    turn = composed(terms, middle, CosSin(cosine, terms.let(sign * sine)))
    return FoundTurn(turn, Linear(a, b, e), sign, terms.let(xi2 * terms.let(inverse**2)))


def near_line(
    terms: Terms,
    a: sp.Expr,
    b: sp.Expr,
    e: sp.Expr,
    sign: sp.Symbol,
    xi2: sp.Expr,
    scale: sp.Expr,
    are_two: sp.Basic | None = None,
) -> FoundTurn:
    """:func:`on_line` where xi^2 does not come from a and b.

    Args:
        terms: Names of all terms.
        a: Coefficient of the cosine.
        b: Coefficient of the sine.
        e: The right side.
        sign: Chooses among the two points.
        xi2: ``a^2 + b^2 - e^2`` but for rounding.
        scale: The size of the terms whose difference xi^2 is.
        are_two: Whether the points are apart; None where xi2 against the scale tells.
    """
    if a == b == 0:
        return FoundTurn(NO_TURN, Linear(a, b, e), sign)
    if e == 0:
        return _through_centre(terms, a, b, sign)
    if are_two is None:
        are_two = xi2 > terms.let(MEETING_SOLUTIONS * scale)
    xi = terms.let(sp.Piecewise((sp.sqrt(xi2), are_two), (sp.Integer(0), True), evaluate=False))
    turned = terms.let(sign * xi)
    turn = direction(terms, terms.let(e * a - turned * b), terms.let(e * b + turned * a))
    return FoundTurn(turn, Linear(a, b, e), sign, ratio(terms, xi2, scale))


def _through_centre(terms: Terms, a: sp.Expr, b: sp.Expr, sign: sp.Symbol) -> FoundTurn:
    """The two points of a line through the centre, which are opposite and always exist."""
    half = direction(terms, -b, a)
    turn = CosSin(terms.let(sign * half.c), terms.let(sign * half.s))
    return FoundTurn(turn, Linear(a, b, sp.Integer(0)), sign)


def ratio(terms: Terms, part: sp.Expr, whole: sp.Expr) -> sp.Expr:
    """The quotient of a part and a whole that is not negative; 0 where both are 0."""
    if terms.is_never_zero(whole):
        return terms.let(part * terms.let(1 / whole))
    return terms.let(part / terms.let(whole + DIVISOR_FLOOR))
