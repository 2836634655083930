"""Rotations about known axes as pairs of cosine and sine, which are carried throughout.

No angle is formed on the way: an angle costs an atan2 that only the result needs, and its cosine
and sine would be rounded twice more.
"""

from dataclasses import dataclass

import sympy as sp

from ..scope import Scope
from ..vectors import Vector, combination, cross, dot

FLOOR = sp.Float("1e-150", 20)
"""What is added to the first of two numbers whose direction is asked for.

It changes no number above 1e-134, its square is no underflow, and the direction of (0, 0) is the
angle 0 instead of 0/0.
"""


@dataclass(frozen=True)
class Turn:
    """Cosine and sine of an angle, both named in a scope."""

    c: sp.Expr
    s: sp.Expr

    @property
    def back(self) -> "Turn":
        """The opposite turn."""
        return Turn(self.c, -self.s)

    def counted(self, sign: int) -> "Turn":
        """The same rotation counted about the opposite axis where the sign is -1."""
        return self if sign == 1 else self.back


NO_TURN = Turn(sp.Integer(1), sp.Integer(0))


def direction(scope: Scope, x: sp.Expr, y: sp.Expr, *, sure: bool = False) -> Turn:
    """The turn by the angle of the vector (x, y), divided by the vector's own length.

    By its own: a length known otherwise would leave a pair that is no rotation where x and y are
    small differences. The direction of (0, 0) is the angle 0.

    Args:
        scope: Names of all terms.
        x: First component.
        y: Second component.
        sure: That the vector is never 0. Opposite vectors then share all but the sign.
    """
    if y == 0 and x == 1:
        return NO_TURN
    return direction_of(scope, x, y, sure=sure)[0]


def direction_of(
    scope: Scope, x: sp.Expr, y: sp.Expr, *, sure: bool = False
) -> tuple[Turn, sp.Expr, sp.Expr]:
    """:func:`direction`, the square of the vector's length and the inverse of the length."""
    x, y = scope.let(x), scope.let(y)
    if not sure and not scope.is_constant(x):
        x = scope.let(x + FLOOR)
    squared = scope.let(x**2 + y**2)
    inverse = scope.let(1 / scope.let(sp.sqrt(squared)))
    return Turn(scope.let(x * inverse), scope.let(y * inverse)), squared, inverse


def composed(scope: Scope, a: Turn, b: Turn) -> Turn:
    """The turn by the sum of two angles."""
    if a == NO_TURN:
        return b
    if b == NO_TURN:
        return a
    return Turn(scope.let(a.c * b.c - a.s * b.s), scope.let(a.s * b.c + a.c * b.s))


def rotated(scope: Scope, k: Vector, turn: Turn, v: Vector) -> Vector:
    """``R(k, theta) v`` by Rodrigues' formula: the part along k, and what turns about it."""
    if turn == NO_TURN:
        return v
    across = perpendicular(scope, k, v)
    along = tuple(scope.let(a - b) for a, b in zip(v, across, strict=True))
    return combination(
        scope, (sp.Integer(1), turn.c, turn.s), (along, across, cross(scope, k, across))
    )


def perpendicular(scope: Scope, k: Vector, v: Vector) -> Vector:
    """The part of a vector that is perpendicular to a unit vector."""
    return combination(scope, (sp.Integer(1), -dot(scope, k, v)), (v, k))


def any_across(scope: Scope, k: Vector) -> Vector:
    """A constant unit vector across a constant one."""
    size = [abs(float(scope.value(component))) for component in k]
    e = [sp.Integer(0)] * 3
    e[size.index(min(size))] = sp.Integer(1)
    x, y, z = perpendicular(scope, k, (e[0], e[1], e[2]))
    length = scope.let(sp.sqrt(x**2 + y**2 + z**2))
    return scope.let(x / length), scope.let(y / length), scope.let(z / length)
