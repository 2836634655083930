"""Subproblem 4: a rotation after which a vector has a known component along another vector.

The equation ``h.(R(k, theta) p) = d`` is solved for theta.

Derivation: let ``p' = p - k (k.p)`` be the component of p perpendicular to k. The left side of the
equation is ``a cos(theta) + b sin(theta) + (h.k)(k.p)`` with ``a = h.p'`` and ``b = h.(k x p)``.
Let ``e = d - (h.k)(k.p)``. The line ``a x + b y = e`` intersects the unit circle at ``(x, y) (a^2 +
b^2) = e (a, b) +- xi (-b, a)``, where ``xi^2 = a^2 + b^2 - e^2``.

If the line misses the unit circle, xi is set to 0, which gives the point of the circle nearest to
the line.

Boundary: at xi = 0, the two solutions coincide. The rounding error of xi^2 is about 1e-16 (a^2 +
b^2). Therefore, the two solutions are merged if xi^2 is less than MEETING_SOLUTIONS (a^2 + b^2). If
nearly equal solutions were not merged, rounding errors would move them by 1e-8 rad, and later
solution steps would not detect the singularity. Merging two nearly equal solutions changes the
component of the rotated vector along h by a relative amount of only 4e-15.

Degenerate: if a = b = 0, the angle is arbitrary and set to 0. For some robot dimensions, a = b = 0
for every target. If a = b = 0 for every target, a target is reachable only if e = 0, and the
solution step has no margin.

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
    """Return the rotation R about the unit vector k with ``h.(R p) = d``."""
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
    """Return an intersection of the line ``a cos + b sin = e`` with the unit circle.

    Args:
        terms: Table of named terms.
        a: Coefficient a of the cosine.
        b: Coefficient b of the sine.
        e: The right-hand side.
        sign: Selects one of the two intersections: 1 for the point counterclockwise from the
            direction (a, b), -1 for the point clockwise from this direction.
        xi2: The value ``a^2 + b^2 - e^2``, computed by the most accurate available formula.
        are_two: Whether the two intersections are distinct, by default whether xi2 exceeds
            ``MEETING_SOLUTIONS`` times a^2 + b^2.
    """
    if a == b == 0:
        return FoundTurn(NO_TURN, Linear(a, b, e), sign)
    if e == 0:
        return _through_center(terms, a, b, sign)
    middle, rho2, inverse = direction_of(terms, a, b)
    if are_two is None:
        are_two = xi2 > terms.let(MEETING_SOLUTIONS * rho2)
    # The divisor is the length of (a, b), which does not depend on xi.
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
    """Solve the same equation as ``on_line`` for an inexact xi2, and normalize cosine and sine.

    Args:
        terms: Table of named terms.
        a: Coefficient a of the cosine.
        b: Coefficient b of the sine.
        e: The right-hand side.
        sign: Selects one of the two points.
        xi2: A computed value of ``a^2 + b^2 - e^2`` that contains a rounding error.
        scale: The magnitude of the terms whose difference is xi2.
        are_two: Whether the two intersections are distinct, by default whether ``xi2`` exceeds
            MEETING_SOLUTIONS times ``scale``.
    """
    if a == b == 0:
        return FoundTurn(NO_TURN, Linear(a, b, e), sign)
    if e == 0:
        return _through_center(terms, a, b, sign)
    if are_two is None:
        are_two = xi2 > terms.let(MEETING_SOLUTIONS * scale)
    xi = terms.let(sp.Piecewise((sp.sqrt(xi2), are_two), (sp.Integer(0), True), evaluate=False))
    turned = terms.let(sign * xi)
    turn = direction(terms, terms.let(e * a - turned * b), terms.let(e * b + turned * a))
    return FoundTurn(turn, Linear(a, b, e), sign, ratio(terms, xi2, scale))


def _through_center(terms: Terms, a: sp.Expr, b: sp.Expr, sign: sp.Symbol) -> FoundTurn:
    """Return a solution of ``a cos + b sin = 0``.

    The sign (1 or -1) selects one of the two angles.
    """
    half = direction(terms, -b, a)
    turn = CosSin(terms.let(sign * half.c), terms.let(sign * half.s))
    return FoundTurn(turn, Linear(a, b, sp.Integer(0)), sign)


def ratio(terms: Terms, part: sp.Expr, whole: sp.Expr) -> sp.Expr:
    """Return ``part / whole`` for a nonnegative ``whole``, or 0 if both are 0."""
    if terms.is_never_zero(whole):
        return terms.let(part * terms.let(1 / whole))
    return terms.let(part / terms.let(whole + DIVISOR_FLOOR))
