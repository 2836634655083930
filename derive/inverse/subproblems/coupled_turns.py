"""Two rotations by equal or opposite angles, after which a component of a vector is known.

Statement: The equation ``h.(R(k1, theta) R(k2, s theta) p) = h.v`` with s = 1 or -1 is solved for
theta. The unit vectors h, k1, k2 and p lie in one plane.

Derivation: let ``h' = h - k1 (k1.h)`` and ``p' = p - k2 (k2.p)``. The terms in sin(theta) vanish,
because h, k1, k2 and p lie in one plane. With the cosine and sine of theta, the left side of the
equation is ``A + B cos + D cos^2 + E sin^2``.

    Two coefficients are ``A = (h.k1) (k1.k2) (k2.p)`` and ``B = (h.k1) (k1.p') + (h'.k2) (k2.p)``.

    Two more coefficients are ``D = h'.p'`` and ``E = -s (k1 x h).(k2 x p)``.

Let ``w = sin^2(theta / 2)``, so that ``cos(theta) = 1 - 2 w``. The equation becomes ``a w^2 - b w +
e = 0`` with ``a = 4 (D - E)``, ``b = 2 B + a`` and ``e = h.p - h.v``.

Up to two roots w lie in [0, 1]. Each root w gives two angles theta of opposite sign. If the formula
for a root would subtract two nearly equal numbers, the root is computed from the product of both
roots. The difference ``1 - w`` is computed in the same way as w, as a root of its own quadratic
equation. The discriminant of the quadratic equation is ``-4 a (x - h.v)``, where ``x = h.p - b^2 /
4 a`` is the extreme component of the rotated vector along h. The components along h at theta = 0,
at theta = pi and at the extreme may be exactly 1 or -1. If a component along h is 1, its difference
from h.v is computed as half the squared length of ``h - v``. If a component along h is -1, its
difference from h.v is computed as minus half the squared length of ``h + v``. Therefore, the
solutions of a straight or folded wrist are as accurate as all other solutions.

Boundary: two solutions coincide at a double root w, at w = 0 and at w = 1. Solutions that differ
only by rounding errors are merged, as in subproblem 4.

Degenerate: the coefficient a is 0 if the vectors of one of the pairs (k1, k2), (h, k1) and (p, k2)
are parallel. None of these three pairs of vectors may be parallel.

Source: elementary.
"""

from dataclasses import dataclass

import sympy as sp

from ...model.tolerances import DIRECTION_FLOOR, EXACT_STRUCTURE, MEETING_SOLUTIONS
from ...terms.terms import Terms
from ...terms.vectors import Vector, added, cross, dot, subtracted
from .equations import LineAndSphere, Linear
from .found import FoundLength, FoundTurn
from .quartic import ONE, ZERO, select
from .turns import direction, perpendicular

Signs = tuple[sp.Expr, sp.Expr]


@dataclass(frozen=True)
class CoupledPair:
    """Two rotations by equal or opposite angles, with the vectors of their equation.

    Attributes:
        h: The direction in which the component of the rotated vector is known.
        k1: The first axis.
        k2: The second axis.
        p: The unit vector that both rotations move.
        sense: 1 if the two rotation angles are equal, -1 if the two angles are opposite.
    """

    h: Vector
    k1: Vector
    k2: Vector
    p: Vector
    sense: int

    def coefficients(self, terms: Terms) -> tuple[sp.Expr, sp.Expr, sp.Expr, sp.Expr]:
        """Return the coefficients of ``A + B cos + D cos^2 + E sin^2``."""
        along, along_p = dot(terms, self.h, self.k1), dot(terms, self.k2, self.p)
        h, p = perpendicular(terms, self.k1, self.h), perpendicular(terms, self.k2, self.p)
        both = dot(terms, cross(terms, self.k1, self.h), cross(terms, self.k2, self.p))
        return (
            terms.let(along * terms.let(dot(terms, self.k1, self.k2) * along_p)),
            terms.let(along * dot(terms, self.k1, p) + dot(terms, h, self.k2) * along_p),
            dot(terms, h, p),
            terms.let(-self.sense * both),
        )

    def middle(self, terms: Terms) -> sp.Expr:
        """Return the h component of the rotated vector at theta = 90 degrees."""
        A, _, _, E = self.coefficients(terms)
        return terms.let(A + E)


def coupled_turns(
    terms: Terms, pair: CoupledPair, v: Vector, signs: Signs
) -> tuple[FoundLength, FoundTurn]:
    """Solve the equation of two coupled rotations for sin^2(theta / 2) and theta.

    Args:
        terms: Table of named terms.
        pair: The rotations.
        v: A unit vector that has the required component along h.
        signs: Two signs: the first sign selects a root w = sin^2(theta / 2), and the second sign is
            the sign of theta.
    """
    let = terms.let
    A, B, D, E = pair.coefficients(terms)
    a, b = let(4 * (D - E)), let(2 * B + 4 * (D - E))
    straight, folded = let(A + B + D), let(A - B + D)
    extreme = let(straight - b**2 / (4 * a))
    e, rest, square = (_excess(terms, pair.h, v, at) for at in (straight, folded, extreme))
    size = let(b**2 + sp.Abs(4 * a))
    square = let(-4 * a * square)
    exists = square > let(_merged(terms, extreme) * size)
    root = let(sp.Piecewise((sp.sqrt(square), exists), (ZERO, True), evaluate=False))
    w = _root(terms, (a, b, e), signs[0], root)
    other = _root(terms, (a, let(2 * a - b), rest), -signs[0], root)
    product = let(w * other)
    least = sp.Min(
        let(w - _merged(terms, straight)), let(other - _merged(terms, folded)), evaluate=False
    )
    are_two = let(least) > 0
    half = let(sp.Piecewise((sp.sqrt(product), are_two), (ZERO, True), evaluate=False))
    turn = direction(terms, let(other - w), let(2 * signs[1] * half))
    quadratic = LineAndSphere(let(-b / a), let(e / a))
    return (
        FoundLength(w, quadratic, signs[0], let(square / size)),
        FoundTurn(turn, Linear(ONE, ZERO, let(other - w)), signs[1], let(4 * product)),
    )


def _root(
    terms: Terms, equation: tuple[sp.Expr, sp.Expr, sp.Expr], sign: sp.Expr, root: sp.Expr
) -> sp.Expr:
    a, b, e = equation
    let = terms.let
    sense = -1 if terms.value(b) < 0 else 1
    # Adding DIRECTION_FLOOR avoids a division by zero at a double root with b = 0.
    floor = sense * DIRECTION_FLOOR if abs(terms.value(b)) < EXACT_STRUCTURE else ZERO
    stable = let(b + sense * root + floor)
    large, small = let(stable / (2 * a)), let(2 * e / stable)
    return select(terms, let(sense * sign) > 0, small, large)


def _excess(terms: Terms, h: Vector, v: Vector, value: sp.Expr) -> sp.Expr:
    """Return ``value - h . v`` for unit vectors h and v.

    If ``value`` is 1 or -1, the difference is computed without cancellation.
    """
    number = float(terms.value(value))
    if abs(abs(number) - 1) > EXACT_STRUCTURE:
        return terms.let(value - dot(terms, h, v))
    apart = subtracted(terms, h, v) if number > 0 else added(terms, h, v)
    return terms.let((1 if number > 0 else -1) * dot(terms, apart, apart) / 2)


def _merged(terms: Terms, value: sp.Expr) -> sp.Expr:
    """Return the threshold for merging two solutions.

    If the component ``value`` is exactly 1 or -1, the threshold is 0.
    """
    is_exact = abs(abs(float(terms.value(value))) - 1) <= EXACT_STRUCTURE
    return ZERO if is_exact else MEETING_SOLUTIONS
