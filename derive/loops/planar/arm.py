"""Vectors on bodies of planar loops, and the rotations between them."""

from dataclasses import dataclass

import sympy as sp

from ...terms.tangents import Tangent
from ...terms.terms import Terms
from ..model.phasors import ZERO, Complex, PhasorSum, conjugate, dot, product


@dataclass(frozen=True)
class Arm:
    """A planar vector on a body, stored as its components at angle zero and its rotation angle.

    Attributes:
        vector: Components of the vector at angle zero, as named terms.
        angle: Angle of rotation from `vector` to the actual vector.
        square: The squared length.
    """

    vector: Complex
    angle: sp.Expr
    square: sp.Expr


def arm(terms: Terms, total: PhasorSum) -> Arm:
    """Combine a sum of vectors with the same angle into one vector."""
    angle = total.common_angle()
    still = total.turned(-angle)
    x, y = still.coordinates(terms)
    if list(still.terms) in ([], [ZERO]):
        # Without a square root, the squared length of a strut stays exact.
        exact = still.terms.get(ZERO, (ZERO, ZERO))
        return Arm((x, y), angle, terms.let(sp.expand(dot(exact, exact))))
    return Arm((x, y), angle, terms.let(x * x + y * y))


def turn_of(terms: Terms, there: Complex, here: Arm) -> tuple[sp.Expr, sp.Expr]:
    """Return the cosine and sine of the rotation angle from ``here.vector`` to ``there``."""
    re, im = product(there, conjugate(here.vector))
    return terms.let(_over(terms, re, here.square)), terms.let(_over(terms, im, here.square))


def rates_of(tangent: Tangent, vector: Complex) -> Complex:
    """Return the rates of the components of a vector."""
    return tangent.of(vector[0]), tangent.of(vector[1])


def _over(terms: Terms, numerator: sp.Expr, square: sp.Expr) -> sp.Expr:
    return terms.let(sp.expand(numerator)) / square
