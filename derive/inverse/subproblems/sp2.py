"""Subproblem 2: two rotations about intersecting axes that move one vector to another.

Statement: The equation ``R(k1, theta1) R(k2, theta2) p = v`` is solved for both angles.

Derivation: The vector ``z = R(k1, theta1)^T v = R(k2, theta2) p`` has the component ``k2.p`` along
k2. Subproblem 4 therefore gives up to two solutions for theta1. For each theta1, subproblem 1 gives
theta2. If theta1 is arbitrary, theta2 is computed for the chosen value of theta1.

Let ``c = k1.k2`` and ``s^2 = 1 - c^2``. If p is nearly parallel to k2, the two solutions for theta1
are nearly equal. In this case, the expression ``xi^2 = |v x k1|^2 s^2 - (k2.p - c k1.v)^2`` of
subproblem 4 is a small difference of large terms. Because p and v have equal lengths, ``xi^2`` is
also equal to ``|p x k2|^2 s^2 - (k1.v - c k2.p)^2``. The terms of this second expression for
``xi^2`` are small if p is nearly parallel to k2. Of the two expressions for ``xi^2``, the one with
the smaller terms is used.

Degenerate: if v is parallel to k1, theta1 is arbitrary and set to 0. If p is parallel to k2, theta2
is arbitrary.

Source: Paden 1986; Elias and Wen 2022, subproblem 2.
"""

import sympy as sp

from ...terms.terms import Terms
from ...terms.vectors import Vector, cross, dot
from .found import FoundTurn
from .sp1 import sp1
from .sp4 import near_line, sp4
from .turns import perpendicular, rotated


def sp2(
    terms: Terms, k1: Vector, k2: Vector, p: Vector, v: Vector, sign: sp.Symbol
) -> tuple[FoundTurn, FoundTurn]:
    """Return the rotations about the unit vectors k1 and k2 with ``R(k1) R(k2) p = v``."""
    across = perpendicular(terms, k2, p)
    r2 = dot(terms, across, across)
    if terms.is_constant(r2):
        first = sp4(terms, v, k1, k2, dot(terms, k2, p), sign)
    else:
        first = _first(terms, k1, k2, p, v, r2, sign)
    # If theta1 exists for all targets, ``R(k1, -theta1) v`` and p have equal distances from axis
    # k2.
    is_regular = terms.is_constant(r2) and first.margin is None
    return first, sp1(terms, k2, p, rotated(terms, k1, first.turn.back, v), is_regular=is_regular)


def _first(
    terms: Terms, k1: Vector, k2: Vector, p: Vector, v: Vector, r2: sp.Expr, sign: sp.Symbol
) -> FoundTurn:
    c = dot(terms, k1, k2)
    s2 = terms.let(1 - c**2)
    along_v, along_p = dot(terms, k1, v), dot(terms, k2, p)
    a = dot(terms, v, perpendicular(terms, k1, k2))
    b = dot(terms, v, cross(terms, k1, k2))
    e = terms.let(along_p - terms.let(c * along_v))
    rho2 = terms.let(a**2 + b**2)
    r2_s2 = terms.let(r2 * s2)
    by_p = terms.let(r2_s2 - terms.let(along_v - terms.let(c * along_p)) ** 2)
    by_v = terms.let(rho2 - e**2)
    xi2 = terms.let(sp.Piecewise((by_p, r2_s2 < rho2), (by_v, True), evaluate=False))
    scale = terms.let(sp.Min(rho2, r2_s2, evaluate=False))
    return near_line(terms, a, b, e, sign, xi2, scale)
