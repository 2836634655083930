"""The constant numbers behind an arm's sixteen eigenvalues, to 40 digits.

In z = exp(i theta) of the suppressed angle the equations are (z L + M0 + conj(L) / z) u = 0, and
the rows of L (12, 12) are combinations of the constant rows of the right side: of rank 8, whatever
the pose. Let N (12, 4) span its kernel, and R (12, 4), real, the complement of N and conj(N). With
t = tan((theta - theta0) / 2), z = exp(i theta0) (1 + i t) / (1 - i t),

    u = Re(N (alpha + i beta) / (1 - i t)) + R gamma,

so that M(theta) (1 + t^2) u is linear in t but for gamma: with delta = t gamma, sixteen unknowns.
Its coefficients of t are (M0 - M1) [-Im N, -Re N, R], M1 that of cos(theta - theta0), and its
constant ones (M0 + M1) [Re N, -Im N, R] and 2 M2 R. The two matrices in brackets are the tables.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import mpmath
import numpy as np
import sympy as sp

from ...model.errors import RobotError
from ...model.robot import Robot
from ...model.tolerances import EVALUATION_DIGITS, KERNEL_GUARD_DIGITS
from .line_quantities import Array
from .raghavan_roth import Split, doubled, equations, placements

UNKNOWNS, KERNEL = 12, 4
ZERO = mpmath.mpf(10) ** (KERNEL_GUARD_DIGITS - EVALUATION_DIGITS)


@dataclass(frozen=True)
class Tables:
    """Constant numbers of an arm, as 40-digit floats.

    Attributes:
        right: (3, 14, 9), the right side of 1, cos and sin of the suppressed angle.
        own: (12, 12), [Re N, -Im N, R].
        back: (12, 12), the inverse of [-Im N, -Re N, R].
        length: The sum of the distances between the arm's frames (metre).
    """

    right: Array
    own: Array
    back: Array
    length: mpmath.mpf


def tables(robot: Robot, split: Split) -> Tables:
    """The tables of an arm.

    Raises:
        RobotError: The dimension of the kernel is not 4, as where the arm has fewer solutions.
    """
    with mpmath.workdps(EVALUATION_DIGITS):
        constants = _constants(robot)
        right = equations(constants, split, np.array(mpmath.eye(4).tolist(), object)).right
        turning = doubled(right[1]) - mpmath.mpc(0, 1) * doubled(right[2])
        kernel = _orthonormal(_kernel(turning))
        if len(kernel) != KERNEL:
            raise RobotError(f"{robot.name}: the right side has a kernel of {len(kernel)}, not 4")
        real = [np.array([entry.real for entry in v], object) for v in kernel]
        imaginary = [np.array([entry.imag for entry in v], object) for v in kernel]
        rest = _completed([*real, *imaginary])
        own = np.stack([*real, *(-v for v in imaginary), *rest], 1)
        met = np.stack([*(-v for v in imaginary), *(-v for v in real), *rest], 1)
        back = np.array((mpmath.matrix(met.tolist()) ** -1).tolist(), object)
        length = sum((mpmath.norm(E[:3, 3].tolist()) for E in constants[1:]), mpmath.mpf(0))
        return Tables(right, own, back, length)


def _constants(robot: Robot) -> list[Array]:
    values = {p.symbol: p.value for p in robot.parameters}

    def number(entry: sp.Expr) -> mpmath.mpf:
        digits = EVALUATION_DIGITS
        return mpmath.mpmathify(sp.Float(entry.xreplace(values).evalf(digits), digits))

    return [np.array([[number(e) for e in row] for row in E], object) for E in placements(robot)]


def _kernel(A: Array) -> list[Array]:
    """A basis of the kernel of A, by elimination with complete pivoting."""
    A, order, rank = A.copy(), list(range(A.shape[1])), 0
    while rank < min(A.shape):
        left = [(abs(A[i, k]), i, k) for i in range(rank, len(A)) for k in range(rank, len(order))]
        size, row, column = max(left, key=lambda entry: entry[0])
        if size < ZERO:
            break
        A[[rank, row]] = A[[row, rank]]
        A[:, [rank, column]] = A[:, [column, rank]]
        order[rank], order[column] = order[column], order[rank]
        A[rank] = A[rank] / A[rank, rank]
        for i in range(len(A)):
            if i != rank:
                A[i] = A[i] - A[i, rank] * A[rank]
        rank += 1
    found = []
    for free in range(rank, len(order)):
        vector = np.array([mpmath.mpc(0)] * len(order), object)
        vector[order[free]] = mpmath.mpc(1)
        for k in range(rank):
            vector[order[k]] = -A[k, free]
        found.append(vector)
    return found


def _orthonormal(vectors: Sequence[Array]) -> list[Array]:
    found: list[Array] = []
    for vector in vectors:
        rest = _beside(vector, found)
        found.append(rest / mpmath.norm(rest.tolist()))
    return found


def _completed(vectors: Sequence[Array]) -> list[Array]:
    """Unit vectors that complete independent real vectors to a basis, best conditioned first."""
    known = _orthonormal(vectors)
    count, size = len(known), len(known[0])
    units = np.array(mpmath.eye(size).tolist(), object)
    while len(known) < size:
        rests = [_beside(unit, known) for unit in units]
        rest = max(rests, key=lambda v: mpmath.norm(v.tolist()))
        known.append(rest / mpmath.norm(rest.tolist()))
    return known[count:]


def _beside(vector: Array, orthonormal: Sequence[Array]) -> Array:
    """The part of a vector that is orthogonal to others."""
    for other in orthonormal:
        vector = (
            vector - sum(mpmath.conj(a) * b for a, b in zip(other, vector, strict=True)) * other
        )
    return vector
