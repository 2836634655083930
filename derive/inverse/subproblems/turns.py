"""Rotations about known axes as pairs of cosine and sine.

No angle is computed in between: it would cost an atan2 that only the result needs, and its cosine
and sine would be rounded twice more.
"""

from dataclasses import dataclass

import sympy as sp

from ...model.tolerances import DIRECTION_FLOOR
from ...terms.terms import Terms
from ...terms.vectors import Vector, combination, cross, dot


@dataclass(frozen=True)
class CosSin:
    """Cosine and sine of an angle, both named terms."""

    c: sp.Expr
    s: sp.Expr

    @property
    def back(self) -> "CosSin":
        """The opposite turn."""
        return CosSin(self.c, -self.s)

    def counted(self, sign: int) -> "CosSin":
        """The same rotation counted about the opposite axis where the sign is -1."""
        return self if sign == 1 else self.back


NO_TURN = CosSin(sp.Integer(1), sp.Integer(0))


def direction(terms: Terms, x: sp.Expr, y: sp.Expr, *, sure: bool = False) -> CosSin:
    """The turn by the angle of the vector (x, y), divided by the vector's own length.

    A length computed in another way would not normalise the pair where x and y are small
    differences. The direction of (0, 0) is the angle 0.

    Args:
        terms: Names of all terms.
        x: First component.
        y: Second component.
        sure: Whether the vector is never 0. Opposite vectors then share all terms but the sign.
    """
    if y == 0 and x == 1:
        return NO_TURN
    return direction_of(terms, x, y, sure=sure)[0]


def direction_of(
    terms: Terms, x: sp.Expr, y: sp.Expr, *, sure: bool = False
) -> tuple[CosSin, sp.Expr, sp.Expr]:
    """:func:`direction`, the square of the vector's length and the inverse of the length."""
    x, y = (terms.let(entry) for entry in (x, y))
    # Squares of noise would vanish from a sum that is divided by.
    x, y = (sp.S.Zero if terms.is_noise(entry) else entry for entry in (x, y))
    if not sure and not (terms.is_never_zero(x) or terms.is_never_zero(y)):
        x = terms.let(x + DIRECTION_FLOOR)
    squared = terms.let(x**2 + y**2)
    inverse = terms.let(1 / terms.let(sp.sqrt(squared)))
    return CosSin(terms.let(x * inverse), terms.let(y * inverse)), squared, inverse


def composed(terms: Terms, a: CosSin, b: CosSin) -> CosSin:
    """The turn by the sum of two angles."""
    if a == NO_TURN:
        return b
    if b == NO_TURN:
        return a
    return CosSin(terms.let(a.c * b.c - a.s * b.s), terms.let(a.s * b.c + a.c * b.s))


def rotated(terms: Terms, k: Vector, turn: CosSin, v: Vector) -> Vector:
    """``R(k, theta) v`` by Rodrigues' formula, which turns the part normal to k."""
    if turn == NO_TURN:
        return v
    across = perpendicular(terms, k, v)
    along = tuple(terms.let(a - b) for a, b in zip(v, across, strict=True))
    return combination(
        terms, (sp.Integer(1), turn.c, turn.s), (along, across, cross(terms, k, across))
    )


def perpendicular(terms: Terms, k: Vector, v: Vector) -> Vector:
    """The part of a vector that is perpendicular to a unit vector."""
    return combination(terms, (sp.Integer(1), -dot(terms, k, v)), (v, k))


def any_across(terms: Terms, k: Vector) -> Vector:
    """A unit vector perpendicular to a unit vector; a constant one to a constant vector.

    Source: Duff et al. 2017, Building an orthonormal basis, revisited, for vectors of the input.
    """
    if not all(terms.is_constant(component) for component in k):
        side = terms.let(sp.Piecewise((1, k[2] >= 0), (-1, True), evaluate=False))
        a = terms.let(-1 / terms.let(side + k[2]))
        return (
            terms.let(1 + side * k[0] ** 2 * a),
            terms.let(side * k[0] * k[1] * a),
            terms.let(-side * k[0]),
        )
    size = [abs(float(terms.value(component))) for component in k]
    e = [sp.Integer(0)] * 3
    e[size.index(min(size))] = sp.Integer(1)
    x, y, z = perpendicular(terms, k, (e[0], e[1], e[2]))
    length = terms.let(sp.sqrt(x**2 + y**2 + z**2))
    return terms.let(x / length), terms.let(y / length), terms.let(z / length)
