"""Rotations about known axes, as pairs of cosine and sine.

Intermediate angles are not computed, because each angle would take a call of atan2 and add two
rounding errors.
"""

from dataclasses import dataclass

import sympy as sp

from ...model.tolerances import DIRECTION_FLOOR
from ...terms.terms import Terms
from ...terms.vectors import Vector, combination, cross, dot


@dataclass(frozen=True)
class CosSin:
    """Cosine and sine of an angle, as named terms."""

    c: sp.Expr
    s: sp.Expr

    @property
    def back(self) -> "CosSin":
        """The opposite rotation."""
        return CosSin(self.c, -self.s)

    def counted(self, sign: int) -> "CosSin":
        """Return this rotation if ``sign`` is 1, or the inverse rotation if ``sign`` is -1."""
        return self if sign == 1 else self.back


NO_TURN = CosSin(sp.Integer(1), sp.Integer(0))


def direction(terms: Terms, x: sp.Expr, y: sp.Expr, *, is_regular: bool = False) -> CosSin:
    """Return the rotation by the angle of the vector (x, y).

    The vector is divided by the length of its rounded components. Therefore, cosine and sine have
    unit norm even if x and y are small differences of large numbers. The vector (0, 0) gives the
    angle 0.

    Args:
        terms: Table of named terms.
        x: First component.
        y: Second component.
        is_regular: Whether the vector (x, y) is nonzero for all inputs. If ``is_regular`` is True,
            the cosine and sine for (-x, -y) are the negated terms for (x, y).
    """
    if y == 0 and x == 1:
        return NO_TURN
    return direction_of(terms, x, y, is_regular=is_regular)[0]


def direction_of(
    terms: Terms, x: sp.Expr, y: sp.Expr, *, is_regular: bool = False
) -> tuple[CosSin, sp.Expr, sp.Expr]:
    """Return the result of ``direction``, and the squared and inverse length of the vector."""
    x, y = (terms.let(entry) for entry in (x, y))
    # Components that consist only of rounding errors are replaced by 0.
    x, y = (sp.S.Zero if terms.is_noise(entry) else entry for entry in (x, y))
    if not is_regular and not (terms.is_never_zero(x) or terms.is_never_zero(y)):
        x = terms.let(x + DIRECTION_FLOOR)
    squared = terms.let(x**2 + y**2)
    inverse = terms.let(1 / terms.let(sp.sqrt(squared)))
    return CosSin(terms.let(x * inverse), terms.let(y * inverse)), squared, inverse


def composed(terms: Terms, a: CosSin, b: CosSin) -> CosSin:
    """Return the rotation by the sum of two angles."""
    if a == NO_TURN:
        return b
    if b == NO_TURN:
        return a
    return CosSin(terms.let(a.c * b.c - a.s * b.s), terms.let(a.s * b.c + a.c * b.s))


def rotated(terms: Terms, k: Vector, turn: CosSin, v: Vector) -> Vector:
    """Return ``R(k, theta) v`` by Rodrigues' formula."""
    if turn == NO_TURN:
        return v
    across = perpendicular(terms, k, v)
    along = tuple(terms.let(a - b) for a, b in zip(v, across, strict=True))
    return combination(
        terms, (sp.Integer(1), turn.c, turn.s), (along, across, cross(terms, k, across))
    )


def perpendicular(terms: Terms, k: Vector, v: Vector) -> Vector:
    """Return the component of ``v`` perpendicular to the unit vector ``k``."""
    return combination(terms, (sp.Integer(1), -dot(terms, k, v)), (v, k))


def any_across(terms: Terms, k: Vector) -> Vector:
    """Return a unit vector perpendicular to ``k``, which is constant for a constant ``k``.

    Source for variable ``k``: Duff et al. 2017, Building an orthonormal basis, revisited.
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
