"""Planar points as sums of rotated vectors.

A point of a planar mechanism is a sum of complex vectors that rotate with the bodies:

    p = sum_k c_k exp(i psi_k)

The angles psi_k are linear in the coordinates and in the solved angles. Each vector c_k is an exact
pair (re, im). The components of c_k contain constants, parameters and variable lengths. Because
equal terms cancel exactly, the motion of a parallelogram linkage is recognized as a pure
translation.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache

import sympy as sp

from ...model.exact import is_zero as constant_is_zero
from ...terms.terms import Terms

Complex = tuple[sp.Expr, sp.Expr]
"""A complex number as the pair (real part, imaginary part)."""
ZERO, ONE = sp.Integer(0), sp.Integer(1)
REAL: Complex = (ONE, ZERO)


def product(a: Complex, b: Complex) -> Complex:
    """Return the product a b."""
    return a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]


def conjugate(a: Complex) -> Complex:
    """Return the complex conjugate of a number."""
    return a[0], -a[1]


def dot(a: Complex, b: Complex) -> sp.Expr:
    """Return the scalar product of two planar vectors."""
    return a[0] * b[0] + a[1] * b[1]


def cross(a: Complex, b: Complex) -> sp.Expr:
    """Return the cross product of two planar vectors.

    The cross product is positive if b is to the left of a.
    """
    return a[0] * b[1] - a[1] * b[0]


def minus(a: Complex, b: Complex) -> Complex:
    """Return the difference a - b."""
    return a[0] - b[0], a[1] - b[1]


@dataclass(frozen=True)
class PhasorSum:
    """A planar point or vector, as a sum of rotated vectors.

    Attributes:
        terms: Mapping from each rotation angle to the vector that is rotated by this angle.
    """

    terms: Mapping[sp.Expr, Complex] = field(default_factory=dict)

    @staticmethod
    def of(vector: Complex, angle: sp.Expr = ZERO) -> "PhasorSum":
        """Return a vector rotated by an angle."""
        return _collected(((angle, vector),))

    def __add__(self, other: "PhasorSum") -> "PhasorSum":
        return _collected((*self.terms.items(), *other.terms.items()))

    def __neg__(self) -> "PhasorSum":
        return PhasorSum({angle: (-re, -im) for angle, (re, im) in self.terms.items()})

    def __sub__(self, other: "PhasorSum") -> "PhasorSum":
        return self + -other

    def times(self, factor: Complex) -> "PhasorSum":
        """Return this phasor sum, multiplied by a complex number."""
        return _collected(tuple((angle, product(c, factor)) for angle, c in self.terms.items()))

    def turned(self, angle: sp.Expr) -> "PhasorSum":
        """Return this phasor sum, rotated by an angle."""
        return _collected(tuple((psi + angle, c) for psi, c in self.terms.items()))

    def common_angle(self) -> sp.Expr:
        """Return the common rotation angle of all terms, or 0 if there is no common angle."""
        angles = list(self.terms)
        return angles[0] if len(angles) == 1 else ZERO

    def coordinates(self, terms: Terms) -> Complex:
        """Return the planar coordinates x and y of this phasor sum, as named terms."""
        x, y = ZERO, ZERO
        for angle, vector in self.terms.items():
            re, im = terms.let(vector[0]), terms.let(vector[1])
            c, s = terms.cos_sin(angle)
            x, y = x + re * c - im * s, y + re * s + im * c
        return terms.let(x), terms.let(y)

    def reduced(
        self, relations: "Sequence[PhasorSum]", cost: "Callable[[PhasorSum], int]"
    ) -> "PhasorSum":
        """Return an equivalent phasor sum with the lowest cost found by using the loop equations.

        Args:
            relations: For each loop, a phasor sum that is zero if the loop is closed.
            cost: Function that returns the quantity to minimize, for example the number of terms.
        """
        candidates = [
            self - relation.times(quotient(self.terms[angle], vector))
            for relation in relations
            for angle, vector in relation.terms.items()
            if angle in self.terms
        ]
        best = min(candidates, key=cost, default=self)
        return best.reduced(relations, cost) if cost(best) < cost(self) else self


@dataclass(frozen=True)
class PlanarPose:
    """The pose of a planar body. A point p of the body is at ``origin + rotor e^(i angle) p``."""

    angle: sp.Expr = ZERO
    rotor: Complex = REAL
    origin: PhasorSum = field(default_factory=PhasorSum)

    def point(self, at: Complex) -> PhasorSum:
        """Return the position of a body point in the plane."""
        return self.origin + self.vector(at)

    def vector(self, along: Complex) -> PhasorSum:
        """Return a direction of the body in the plane."""
        return PhasorSum.of(product(self.rotor, along), self.angle)

    def carried(self, other: "PlanarPose") -> "PlanarPose":
        """Return the product of two planar poses.

        If ``self`` is the pose of a first body, ``other`` is the pose of a second body relative to
        the first body.
        """
        return PlanarPose(
            sp.expand(self.angle + other.angle),
            product(self.rotor, other.rotor),
            self.origin + other.origin.times(self.rotor).turned(self.angle),
        )


def quotient(a: Complex, b: Complex) -> Complex:
    """Return the quotient a / b."""
    re, im = product(a, conjugate(b))
    square = dot(b, b)
    return re / square, im / square


def is_zero(expression: sp.Expr) -> bool:
    """Whether an exact expression is zero for all values of its symbols."""
    return bool(_plain(expression) == 0)


@cache  # The sums are cached, because all branches add the same vectors.
def _collected(terms: tuple[tuple[sp.Expr, Complex], ...]) -> PhasorSum:
    sums: dict[sp.Expr, Complex] = {}
    for angle, (re, im) in terms:
        key = _expanded(angle)
        old = sums.get(key, (ZERO, ZERO))
        sums[key] = _plain(old[0] + re), _plain(old[1] + im)
    present = [(angle, c) for angle, c in sums.items() if c[0] != 0 or c[1] != 0]
    return PhasorSum(dict(sorted(present, key=lambda item: _order(item[0]))))


@cache
def _expanded(angle: sp.Expr) -> sp.Expr:
    return sp.expand(angle)


@cache
def _order(angle: sp.Expr) -> tuple[int, str]:
    # Names are sorted by length first, so _t10 comes after _t9.
    text = str(angle)
    return len(text), text


@cache
def _plain(expression: sp.Expr) -> sp.Expr:
    """Return an expression after cancellation of equal terms and common factors."""
    if expression.is_Rational or expression.is_Symbol:
        return expression
    if not expression.free_symbols:
        return ZERO if constant_is_zero(expression) else expression
    # Without quotients and roots, an expansion is sufficient, and is much faster than a
    # cancellation.
    if expression.is_polynomial(*expression.free_symbols):
        return sp.expand(expression)
    numerator, denominator = expression.as_numer_denom()
    if denominator.is_Number:
        return sp.expand(expression)
    factor, numerator, denominator = sp.cancel((numerator, denominator))
    return factor * (numerator / denominator)
