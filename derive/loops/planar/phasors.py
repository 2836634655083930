"""Points of a plane as sums of turning vectors: the algebra in which planar loops are solved.

A point of a planar mechanism is a sum of complex vectors, each turning with its body:

    p = sum_k c_k exp(i psi_k)

Angles psi are linear in coordinates and in the angles of solved links, and the vectors c_k are
exact (re, im) pairs of numbers, parameters and lengths that are coordinates. That a parallelogram
only translates shows here, because sums of angles and of vectors cancel exactly.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache

import sympy as sp

from ...model.exact import is_zero as constant_is_zero
from ...terms.terms import Terms

Complex = tuple[sp.Expr, sp.Expr]
"""Real and imaginary part."""
ZERO, ONE = sp.Integer(0), sp.Integer(1)
REAL: Complex = (ONE, ZERO)


def product(a: Complex, b: Complex) -> Complex:
    """A b."""
    return a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]


def conjugate(a: Complex) -> Complex:
    """The conjugate of a."""
    return a[0], -a[1]


def dot(a: Complex, b: Complex) -> sp.Expr:
    """The scalar product of two vectors of the plane."""
    return a[0] * b[0] + a[1] * b[1]


def cross(a: Complex, b: Complex) -> sp.Expr:
    """The area that two vectors of the plane span, positive where b stands to the left of a."""
    return a[0] * b[1] - a[1] * b[0]


def minus(a: Complex, b: Complex) -> Complex:
    """A - b."""
    return a[0] - b[0], a[1] - b[1]


@dataclass(frozen=True)
class PhasorSum:
    """A point or vector of the plane: a complex vector for each angle it turns by.

    Attributes:
        terms: The vectors by angle; an angle is 0 or linear in symbols, without a constant part.
    """

    terms: Mapping[sp.Expr, Complex] = field(default_factory=dict)

    @staticmethod
    def of(vector: Complex, angle: sp.Expr = ZERO) -> "PhasorSum":
        """A vector that turns by an angle."""
        return _collected(((angle, vector),))

    def __add__(self, other: "PhasorSum") -> "PhasorSum":
        return _collected((*self.terms.items(), *other.terms.items()))

    def __neg__(self) -> "PhasorSum":
        return PhasorSum({angle: (-re, -im) for angle, (re, im) in self.terms.items()})

    def __sub__(self, other: "PhasorSum") -> "PhasorSum":
        return self + -other

    def times(self, factor: Complex) -> "PhasorSum":
        """The sum times a complex number."""
        return _collected(tuple((angle, product(c, factor)) for angle, c in self.terms.items()))

    def turned(self, angle: sp.Expr) -> "PhasorSum":
        """The sum turned by an angle."""
        return _collected(tuple((psi + angle, c) for psi, c in self.terms.items()))

    def common_angle(self) -> sp.Expr:
        """The angle by which all of it turns; 0 where its parts turn differently."""
        angles = list(self.terms)
        return angles[0] if len(angles) == 1 else ZERO

    def coordinates(self, terms: Terms) -> Complex:
        """Named coordinates x and y in the plane's axes."""
        x, y = ZERO, ZERO
        for angle, vector in self.terms.items():
            re, im = terms.let(vector[0]), terms.let(vector[1])
            c, s = terms.cos_sin(angle)
            x, y = x + re * c - im * s, y + re * s + im * c
        return terms.let(x), terms.let(y)

    def reduced(
        self, relations: "Sequence[PhasorSum]", cost: "Callable[[PhasorSum], int]"
    ) -> "PhasorSum":
        """The same vector in a cheaper form, if the loop equations give such a form.

        Args:
            relations: Sums that are zero, one for each loop.
            cost: The quantity to minimise, for instance the number of terms.
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
    """A body in a plane: points p of the body are at ``origin + rotor e^(i angle) p``."""

    angle: sp.Expr = ZERO
    rotor: Complex = REAL
    origin: PhasorSum = field(default_factory=PhasorSum)

    def point(self, at: Complex) -> PhasorSum:
        """Where a point of the body is in the plane."""
        return self.origin + self.vector(at)

    def vector(self, along: Complex) -> PhasorSum:
        """A direction of the body in the plane."""
        return PhasorSum.of(product(self.rotor, along), self.angle)

    def carried(self, other: "PlanarPose") -> "PlanarPose":
        """The pose in this pose's plane of a body at ``other`` on this body."""
        return PlanarPose(
            sp.expand(self.angle + other.angle),
            product(self.rotor, other.rotor),
            self.origin + other.origin.times(self.rotor).turned(self.angle),
        )


def quotient(a: Complex, b: Complex) -> Complex:
    """A / b."""
    re, im = product(a, conjugate(b))
    square = dot(b, b)
    return re / square, im / square


def is_zero(expression: sp.Expr) -> bool:
    """Whether an exact expression is zero, whatever the values of its symbols are."""
    return bool(_plain(expression) == 0)


@cache  # The branches of a linkage add the same vectors.
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
    # Terms are named by number: by length first, so that _t10 comes after _t9.
    text = str(angle)
    return len(text), text


@cache
def _plain(expression: sp.Expr) -> sp.Expr:
    """An expression in which terms that cancel are removed."""
    if expression.is_Rational or expression.is_Symbol:
        return expression
    if not expression.free_symbols:
        return ZERO if constant_is_zero(expression) else expression
    # Sums without quotients and roots are plain when they are expanded, which takes far less time.
    if expression.is_polynomial(*expression.free_symbols):
        return sp.expand(expression)
    # A fraction is cancelled in half the time of an expression, of which SymPy takes the common
    # factors first.
    numerator, denominator = expression.as_numer_denom()
    if denominator.is_Number:
        return sp.expand(expression)
    factor, numerator, denominator = sp.cancel((numerator, denominator))
    return factor * (numerator / denominator)
