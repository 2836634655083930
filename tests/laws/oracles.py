"""Cases, the tolerance and independent formulas for the tests of identities.

The oracles use only definitions: the matrix exponential and power series. mpmath evaluates them
with 40 digits at the exact binary values of the inputs.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterator
from typing import TypeAlias

import mpmath
from sympy import Float, ImmutableDenseMatrix, factorial

from . import lie

Matrix: TypeAlias = ImmutableDenseMatrix

# For inputs of order one, the rounding error of float64 is about 1e-15. For products of poses and
# for rotations by pi, the error is up to 1e-11.
LAW_TOLERANCE = mpmath.mpf("1e-12")

DIGITS = 40
MAX_TERMS = 120

SMALL_ANGLES = [0.0, 1e-8, 1e-4]
BRANCH_ANGLES = [1 - 1e-9, 1 + 1e-9]
NEAR_HALF_TURN = [math.pi - 10.0**-k for k in (3, 6, 9, 10)]
# Tests of the logarithm use PRINCIPAL_ANGLES; tests of the exponential use ANGLES.
PRINCIPAL_ANGLES = [*SMALL_ANGLES, 0.3, *BRANCH_ANGLES, 2.0, 3.0, *NEAR_HALF_TURN]
ANGLES = [*SMALL_ANGLES, 0.3, *BRANCH_ANGLES, 3.0, *NEAR_HALF_TURN[:3], math.pi, 4.0, 6.0]

AXES = [
    (0.0, 0.0, 1.0),
    (math.sqrt(0.5), -math.sqrt(0.5), 0.0),
    (2 / 7, -3 / 7, 6 / 7),
    (-0.48, -0.64, 0.6),
]
LINEAR = [(0.0, 0.0, 0.0), (0.4, -1.1, 0.7), (1e-8, 2e-8, -1e-8)]


def vector(*entries: float) -> Matrix:
    """Return a column of Floats."""
    return Matrix([Float(e) for e in entries])


def rotation_vectors(angles: list[float]) -> list[Matrix]:
    """Return the rotation vectors for all pairs of an angle and an axis in `AXES`."""
    return [vector(*(angle * a for a in axis)) for angle in angles for axis in AXES]


def twists(angles: list[float]) -> list[Matrix]:
    return [
        Matrix.vstack(vector(*LINEAR[k % len(LINEAR)]), omega)
        for k, omega in enumerate(rotation_vectors(angles))
    ]


def few_twists(angles: list[float]) -> list[Matrix]:
    return [
        vector(*LINEAR[k % len(LINEAR)], *(angle * a for a in AXES[k % len(AXES)]))
        for k, angle in enumerate(angles)
    ]


def random_twists(count: int, seed: int) -> list[Matrix]:
    """Return twists with entries between -1.5 and 1.5."""
    draw = random.Random(seed)
    return [vector(*(draw.uniform(-1.5, 1.5) for _ in range(6))) for _ in range(count)]


def random_poses(count: int, seed: int) -> list[Matrix]:
    """Return poses as exponentials of random twists."""
    return [lie.exp_se3(x) for x in random_twists(count, seed)]


def wide(M: Matrix) -> mpmath.matrix:
    """Convert a matrix to numbers with 40-digit precision."""
    with mpmath.workdps(DIGITS):
        return mpmath.matrix([[e._to_mpmath(DIGITS * 4) for e in row] for row in M.tolist()])


def distance(A: Matrix | mpmath.matrix, B: Matrix | mpmath.matrix) -> mpmath.mpf:
    """Return the largest difference of two matrices. NaN counts as infinite."""
    with mpmath.workdps(DIGITS):
        A, B = (M if isinstance(M, mpmath.matrix) else wide(M) for M in (A, B))
        assert (A.rows, A.cols) == (B.rows, B.cols)
        differences = [abs(d) for d in A - B]
        return mpmath.inf if any(map(mpmath.isnan, differences)) else max(differences)


def assert_close(A: Matrix | mpmath.matrix, B: Matrix | mpmath.matrix, case: object = "") -> None:
    """Fail if two numerical matrices differ by more than the tolerance."""
    assert distance(A, B) <= LAW_TOLERANCE, f"off by {mpmath.nstr(distance(A, B), 5)} at {case}"


def power_series(X: mpmath.matrix, coefficient: Callable[[int], mpmath.mpf]) -> mpmath.matrix:
    """Return the sum of coefficient(k) X^k at 40-digit precision."""
    with mpmath.workdps(DIGITS):
        total, power, small = mpmath.zeros(X.rows), mpmath.eye(X.rows), 0
        for k in range(MAX_TERMS):
            term = coefficient(k) * power
            total, power = total + term, power * X
            small = small + 1 if max(map(abs, term)) < mpmath.mpf("1e-35") else 0
            if small == 2:
                return total
    raise AssertionError(f"the series has not converged after {MAX_TERMS} terms")


def expm(X: Matrix) -> mpmath.matrix:
    with mpmath.workdps(DIGITS):
        return mpmath.expm(wide(X), method="taylor")


def dexp_series(X: Matrix) -> mpmath.matrix:
    """Return dexp by its definition: the sum of X^k / (k + 1)!, with X = hat(omega) or ad(x)."""
    return power_series(wide(X), lambda k: mpmath.mpf(1) / int(factorial(k + 1)))


def pairs(items: list[Matrix]) -> Iterator[tuple[Matrix, Matrix]]:
    """Return pairs of each item and its successor.

    The successor of the last item is the first item.
    """
    return zip(items, items[1:] + items[:1], strict=True)
