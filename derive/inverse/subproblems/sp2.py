"""Subproblem 2: two rotations about intersecting axes that carry a vector to another.

Statement: ``R(k1, theta1) R(k2, theta2) p = v``.

Derivation: ``z = R(k1, theta1)^T v = R(k2, theta2) p`` has the part ``k2 . p`` along k2, so that
subproblem 4 gives theta1, up to a sign; the second angle follows from the first by subproblem 1.
Taken in this order the two belong together, and where the first is undetermined the second still
fits it.

Degenerate: where v lies along k1 every theta1 will do. The caller may give the one to take.

Source: Paden 1986; Elias and Wen 2022, subproblem 2.
"""

import sympy as sp

from ...scope import Scope
from ...vectors import Vector, dot
from ..found import FoundTurn
from ..turns import rotated
from .sp1 import sp1
from .sp4 import sp4


def sp2(
    scope: Scope, k1: Vector, k2: Vector, p: Vector, v: Vector, sign: sp.Symbol
) -> tuple[FoundTurn, FoundTurn]:
    """The turns about the unit vectors k1 and k2 with ``R(k1) R(k2) p = v``."""
    first = sp4(scope, v, k1, k2, dot(scope, k2, p), sign)
    second = sp1(scope, k2, p, rotated(scope, k1, first.turn.back, v))
    return first, second
