"""Every assembly mode of a planar platform on three legs, at given actuators.

A platform that three rods hold can be assembled in up to six ways. The generated code eliminates
its position; the angle phi then satisfies

    a_0 + sum_k (a_k cos(k phi) + b_k sin(k phi)) = 0,   k = 1, 2, 3

which, with z = exp(i phi), is a polynomial of degree 6 in z whose roots on the unit circle are the
modes. They are the eigenvalues of its companion matrix, refined by Newton's iteration on the
lengths of the rods.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..call._call import Function
from ..call.capabilities import needs
from ..tolerances import (
    MODE_STEP,
    NEAR_CIRCLE,
    NEAR_PAIR,
    RODS_CLOSED,
    RODS_POLISHED,
    SAME_MODE,
    SETTLED_STEP,
    VANISHING,
)

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.intp]

MODES = 6
_DEGREE = 3
_ITERATIONS = 12
_BLOCK = 50_000
"""Inputs solved at a time: some 60 MB of companion matrices."""


class PlanarModes(NamedTuple):
    """The assembly modes of a planar platform, in the order of phi.

    Attributes:
        x: (..., 6, 3) poses (x, y [m], phi [rad] in (-pi, pi]) of the platform; unused slots, which
            are the last, are NaN.
        valid: (..., 6) whether a slot holds a mode: all rods then have their lengths to 1e-12 m.
    """

    x: FloatArray
    valid: BoolArray


class PlanarMethods:
    """The methods of a platform on three planar legs."""

    n: int
    functions: Mapping[str, Function[Any]]
    _roles: Mapping[tuple[str, str, str], Function[Any]]
    assembly_polynomial: Function[FloatArray]
    assembly_position: Function[FloatArray]
    assembly_mirror: Function[FloatArray]
    rods: Function[FloatArray]
    rods_D_chain: Function[FloatArray]

    @needs("assembly_polynomial", "assembly_position", "rods", "rods_D_chain")
    def fk_planar_all(self, q: ArrayLike) -> PlanarModes:
        """Every pose in which the platform can be assembled at given actuators.

        Two modes less than 1e-7 (metre, radian) apart count as one; where they meet the platform is
        at a singularity of type 2. Where the three rods turn in parallel, a whole circle of poses
        is possible and the method finds none of them.

        Args:
            q: (..., n) actuated coordinates [rad or m].

        Returns:
            `x (..., 6, 3)` and `valid (..., 6)`.

        Source:
            Gosselin, Sefrioui and Richard, Solutions polynomiales au probleme de la cinematique des
            manipulateurs paralleles plans a trois degres de liberte, 1992.
        """
        polynomial = self.assembly_polynomial(q)
        batch = polynomial.shape[:-1]
        rows = np.ascontiguousarray(np.broadcast_to(np.asarray(q, np.float64), (*batch, self.n)))
        rows, polynomial = rows.reshape(-1, self.n), polynomial.reshape(-1, 2 * _DEGREE + 1)
        cuts = range(_BLOCK, len(rows), _BLOCK)
        blocks = [
            self._modes(*block)
            for block in zip(np.split(rows, cuts), np.split(polynomial, cuts), strict=True)
        ]
        x = np.concatenate(blocks).reshape(*batch, MODES, 3)
        return PlanarModes(x, np.asarray(np.isfinite(x).all(-1)))

    def _modes(self, q: FloatArray, polynomial: FloatArray) -> FloatArray:
        """(N, 6, 3) modes of a block, NaN behind the last."""
        row, x = self._starts(q, roots(polynomial))
        x = self._polished(x, q[row])
        return _gathered(len(q), row, x)

    def _starts(self, q: FloatArray, z: NDArray[np.complex128]) -> tuple[IntArray, FloatArray]:
        """The starts of the iteration: row of q, and pose."""
        row, slot = np.nonzero(np.abs(np.abs(z) - 1) < NEAR_CIRCLE)
        phi = np.angle(z[row, slot])
        x = self.assembly_position(q[row], phi)
        mirror = self._roles.get(("assembly mirror", "actuators", ""))
        if mirror is None:
            return row, x
        distance = np.abs(z[:, :, None] - z[:, None, :])
        paired = ((distance < NEAR_PAIR).sum(-1) > 1)[row, slot]
        other = mirror(q[row[paired]], phi[paired])
        return np.concatenate([row, row[paired]]), np.concatenate([x, other])

    def _polished(self, x: FloatArray, q: FloatArray) -> FloatArray:
        """Newton's iteration on the rods; NaN where it reaches no mode."""
        x = x.copy()
        active = np.flatnonzero(np.isfinite(x).all(-1))
        error, step = np.full(len(x), np.inf), np.full(len(x), np.inf)
        for _ in range(_ITERATIONS):
            residual = self.rods(x[active], q[active])
            error[active] = np.abs(residual).max(-1, initial=0.0)
            going = (error[active] > RODS_POLISHED) | (step[active] > SETTLED_STEP)
            active, residual = active[going], residual[going]
            if not len(active):
                break
            change = _solved(self.rods_D_chain(x[active], q[active]), residual)
            change *= MODE_STEP / np.maximum(np.abs(change[:, 2:]), MODE_STEP)
            x[active] -= change
            step[active] = np.abs(change).max(-1)
            active = active[np.isfinite(step[active])]
        error[:] = np.abs(self.rods(x, q)).max(-1, initial=0.0)
        # Negated, so that NaN counts as no mode.
        x[~(error <= RODS_CLOSED)] = np.nan
        # Into (-pi, pi], angles that rounding left at -pi included.
        x[:, 2] = np.pi - np.mod(np.pi - x[:, 2], 2 * np.pi)
        return x


def roots(polynomial: FloatArray) -> NDArray[np.complex128]:
    """Roots z = exp(i phi) of real trigonometric polynomials of degree 3.

    The polynomial in z is its own reciprocal: if the leading coefficient vanishes, so does the last
    one. Then one root is at infinity and one at zero, neither is an angle, and the degree is two
    less.

    Args:
        polynomial: (N, 7) coefficients a_0, a_1, b_1, a_2, b_2, a_3, b_3.

    Returns:
        (N, 6), NaN behind the last.
    """
    a, b = polynomial[:, [1, 3, 5]], polynomial[:, [2, 4, 6]]
    half = (a - 1j * b) / 2
    # Coefficients of exp(i k phi) for k = 3, 2 ... -3.
    all_ = np.concatenate([half[:, ::-1], polynomial[:, :1], half.conj()], axis=1)
    size = np.abs(all_).max(-1)
    found = np.full((len(polynomial), MODES), np.nan + 0j)
    left = np.isfinite(size)
    for drop in range(_DEGREE):
        degree = 2 * (_DEGREE - drop)
        rows = np.flatnonzero(left & (np.abs(all_[:, drop]) > VANISHING * size))
        left[rows] = False
        coefficients = all_[rows, drop : drop + degree + 1]
        companion = np.zeros((len(rows), degree, degree), complex)
        companion[:, range(1, degree), range(degree - 1)] = 1
        companion[:, 0] = -coefficients[:, 1:] / coefficients[:, :1]
        found[rows, :degree] = np.linalg.eigvals(companion)
    return found


def _solved(J: FloatArray, right: FloatArray) -> FloatArray:
    """J x = right for 3 x 3 matrices, by cofactors: infinite or NaN, not an error, if singular."""
    first, second, third = J[:, 0], J[:, 1], J[:, 2]
    cofactors = [np.cross(second, third), np.cross(third, first), np.cross(first, second)]
    total = sum(c * right[:, k, None] for k, c in enumerate(cofactors))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        return np.asarray(total / (first * cofactors[0]).sum(-1, keepdims=True))


def _gathered(n: int, row: IntArray, x: FloatArray) -> FloatArray:
    """The modes of each row, sorted by phi, each once; (n, 6, 3)."""
    found = np.isfinite(x).all(-1)
    row, x = row[found], x[found]
    order = np.lexsort((x[:, 1], x[:, 0], x[:, 2], row))
    row, x = row[order], x[order]
    position = np.arange(len(row)) - np.searchsorted(row, row)
    table = np.full((n, 2 * MODES, 3), np.nan)
    table[row, position] = x
    for k in range(1, 2 * MODES):
        difference = np.abs(table[:, :k] - table[:, k, None])
        # -pi and pi are the same angle.
        difference[..., 2] = np.minimum(difference[..., 2], 2 * np.pi - difference[..., 2])
        again = (difference < SAME_MODE).all(-1).any(-1)
        table[again, k] = np.nan
    last = np.argsort(np.isnan(table[..., 2]), axis=-1, kind="stable")[:, :MODES]
    return np.take_along_axis(table, last[..., None], axis=1)
