"""Arms: vectors that are constant on a body up to known coordinates, and the turns between them."""

from dataclasses import dataclass

import sympy as sp

from ...terms.tangents import Tangent
from ...terms.terms import Terms
from .phasors import ZERO, Complex, PhasorSum, conjugate, dot, product


@dataclass(frozen=True)
class Arm:
    """A vector that is constant on a body up to known coordinates, its common angle split off.

    Attributes:
        vector: Named components where the angle is zero.
        angle: The angle by which the whole vector turns on its body.
        square: The square of its length.
    """

    vector: Complex
    angle: sp.Expr
    square: sp.Expr


def arm(terms: Terms, total: PhasorSum) -> Arm:
    """A sum of turning vectors as one vector."""
    angle = total.common_angle()
    still = total.turned(-angle)
    x, y = still.coordinates(terms)
    if list(still.terms) in ([], [ZERO]):
        # Exact: a strut's squared length is the square of its length, not the square of a root.
        exact = still.terms.get(ZERO, (ZERO, ZERO))
        return Arm((x, y), angle, terms.let(sp.expand(dot(exact, exact))))
    return Arm((x, y), angle, terms.let(x * x + y * y))


def turn_of(terms: Terms, there: Complex, here: Arm) -> tuple[sp.Expr, sp.Expr]:
    """Cosine and sine of the turn that carries an arm to a vector of the same length."""
    re, im = product(there, conjugate(here.vector))
    return terms.let(_over(terms, re, here.square)), terms.let(_over(terms, im, here.square))


def rates_of(tangent: Tangent, vector: Complex) -> Complex:
    """The named rates of a vector's components."""
    return tangent.of(vector[0]), tangent.of(vector[1])


def _over(terms: Terms, numerator: sp.Expr, square: sp.Expr) -> sp.Expr:
    return terms.let(sp.expand(numerator)) / square
