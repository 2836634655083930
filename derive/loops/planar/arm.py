"""Arms of planar loops: body-fixed vectors, and the rotations between such vectors."""

from dataclasses import dataclass

import sympy as sp

from ...terms.tangents import Tangent
from ...terms.terms import Terms
from ..model.phasors import ZERO, Complex, PhasorSum, conjugate, dot, product


@dataclass(frozen=True)
class Arm:
    """A body-fixed vector with known coordinates; its rotation angle is stored separately.

    Attributes:
        vector: Named components at angle zero.
        angle: Angle by which the vector is rotated relative to its body.
        square: The squared length.
    """

    vector: Complex
    angle: sp.Expr
    square: sp.Expr


def arm(terms: Terms, total: PhasorSum) -> Arm:
    """Combines a sum of vectors that rotate by a common angle into one vector."""
    angle = total.common_angle()
    still = total.turned(-angle)
    x, y = still.coordinates(terms)
    if list(still.terms) in ([], [ZERO]):
        # The squared length of a strut stays exact if it is computed without a square root.
        exact = still.terms.get(ZERO, (ZERO, ZERO))
        return Arm((x, y), angle, terms.let(sp.expand(dot(exact, exact))))
    return Arm((x, y), angle, terms.let(x * x + y * y))


def turn_of(terms: Terms, there: Complex, here: Arm) -> tuple[sp.Expr, sp.Expr]:
    """Returns cosine and sine of the rotation from a body-fixed vector to a vector."""
    re, im = product(there, conjugate(here.vector))
    return terms.let(_over(terms, re, here.square)), terms.let(_over(terms, im, here.square))


def rates_of(tangent: Tangent, vector: Complex) -> Complex:
    """Returns the rates of a vector's components."""
    return tangent.of(vector[0]), tangent.of(vector[1])


def _over(terms: Terms, numerator: sp.Expr, square: sp.Expr) -> sp.Expr:
    return terms.let(sp.expand(numerator)) / square
