"""Parallel singularities: determinants, and distances along lines."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import BoolArray, FloatArray, IntArray
from ..call.capabilities import needs
from ..closed_form.closures import LoopMethods, has_leg_inverse
from .singularity import SingularityMethods

_SAMPLES = 512
_HALVINGS = 48
"""Number of bisections of an interval."""


class Determinants(NamedTuple):
    """Dimensionless determinants of the velocity relation J_x x' = J_q q'.

    Attributes:
        J_x: (...,) determinant of J_x, which changes sign at a singularity of type 2.
        J_q: (...,) determinant of J_q, or sqrt(det(J_q^T J_q)) for a rectangular J_q. The
            determinant is 0 at a singularity of type 1.
    """

    J_x: FloatArray
    J_q: FloatArray


class SingularityDistance(NamedTuple):
    """Distances to singularities, as multiples of a direction vector, or inf if none is found.

    Attributes:
        type_1: (...,) distance to a pose at which a leg is stretched or folded.
        type_2: (...,) distance to a pose at which the platform gains a degree of freedom.
    """

    type_1: FloatArray
    type_2: FloatArray


class SingularDirectionMethods(LoopMethods, SingularityMethods):
    """Methods of robots with a velocity relation and a leg inverse."""

    @needs("velocity_relation")
    def determinants(
        self, theta: ArrayLike, q: ArrayLike, *, characteristic_length: float | None = None
    ) -> Determinants:
        """Return the determinants `J_x (...,)` and `J_q (...,)`, or NaN if a loop is open.

        Jacobians, arguments and errors are the same as for `singularity`.
        """
        J_x, J_q = self._pure_relation("determinants", theta, q, characteristic_length)
        return Determinants(_determinant(J_x)[()], _determinant(J_q)[()])

    @needs("velocity_relation", when=has_leg_inverse)
    def distance_to_singularity(
        self, theta: ArrayLike, direction: ArrayLike, q: ArrayLike | None = None
    ) -> SingularityDistance:
        """Return the distances to the first singularities along the line theta + s * direction.

        The range 0 < s <= 1 is sampled in 512 intervals. A bisection to double precision refines
        the first interval in which a determinant changes sign or a leg goes out of reach. Two
        singularities in one interval are missed. The legs stay on their branches.

        Args:
            theta: (..., n_theta) main-chain joints at the start [rad or m].
            direction: (..., n_theta) displacement for s = 1 [rad or m].
            q: (..., n) actuated coordinates at the start, which select the leg branches; the
                branches of the reference configuration if None.

        Returns:
            `type_1 (...,)` and `type_2 (...,)`: for each type, the smallest s with a singularity.
            The value is inf if there is no singularity up to s = 1, and NaN if the start is out of
            reach.
        """
        method, n = "distance_to_singularity", len(self.chain_joints)
        start = self._reals(method, "theta", theta, (n,))
        start, step = np.broadcast_arrays(start, self._reals(method, "direction", direction, (n,)))
        batch, start, step = start.shape[:-1], start.reshape(-1, n), step.reshape(-1, n)
        slots = self._slots(start, q)
        rows = np.arange(len(start))

        def f(s: FloatArray, at: IntArray) -> tuple[FloatArray, FloatArray]:
            there = start[at] + s[:, None] * step[at]
            margin, determinant = self._values(there, slots[at])
            return margin.min(-1), determinant

        s = np.linspace(0, 1, _SAMPLES + 1)
        margin, determinant = (
            part.reshape(len(start), len(s))
            for part in f(np.tile(s, len(start)), np.repeat(rows, len(s)))
        )
        reached = margin >= 0
        leaves = ~reached[:, 1:]
        type_1 = np.full(len(start), np.inf)
        low, high, at = _brackets(leaves, s)
        type_1[at] = _bisected(lambda x: f(x, at)[0] >= 0, low, high)
        # The interval with the type 1 singularity may also contain a type 2 singularity.
        turned = (determinant[:, 1:] > 0) != (determinant[:, :-1] > 0)
        turned[at, leaves[at].argmax(1)] = (f(type_1[at], at)[1] > 0) != (f(low, at)[1] > 0)
        type_2 = np.full(len(start), np.inf)
        low, high, at = _brackets(turned, s)
        high = np.minimum(high, type_1[at])
        type_2[at] = _bisected(lambda x: f(x, at)[1] > 0, low, high)
        # The platform has no pose beyond the type 1 singularity.
        type_2[type_2 > type_1] = np.inf
        for found in (type_1, type_2):
            found[~reached[:, 0]] = np.nan
        return SingularityDistance(type_1.reshape(batch)[()], type_2.reshape(batch)[()])

    def _branches(self, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return actuated coordinates (N, k, n) and margins (N, k, legs) of all branches."""
        q, margin = self._leg_branches(theta)
        return q, margin if margin.ndim == q.ndim else margin[..., None]

    def _slots(self, theta: FloatArray, q: ArrayLike | None) -> IntArray:
        if q is None:
            return np.zeros(len(theta), np.intp)
        apart = self._branches(theta)[0] - np.broadcast_to(q, (len(theta), self.n))[:, None]
        turns = [c.unit == "rad" for c in self.coordinates]
        apart[..., turns] = np.remainder(apart[..., turns] + np.pi, 2 * np.pi) - np.pi
        size = np.where(np.isfinite(apart), np.abs(apart), np.inf).max(-1)
        return np.asarray(size.argmin(-1))

    def _values(self, theta: FloatArray, slots: IntArray) -> tuple[FloatArray, FloatArray]:
        q, margin = self._branches(theta)
        rows = np.arange(len(theta))
        J_x, _ = self._pure_relation("determinants", theta, q[rows, slots], None)
        return margin[rows, slots], _determinant(J_x)


def _determinant(J: FloatArray) -> FloatArray:
    sound = np.asarray(np.isfinite(J).all((-2, -1)))
    J = np.where(sound[..., None, None], J, 0.0)
    if J.shape[-2] == J.shape[-1]:
        found = np.linalg.det(J)
    else:
        found = np.sqrt(np.maximum(np.linalg.det(np.swapaxes(J, -1, -2) @ J), 0.0))
    return np.asarray(np.where(sound, found, np.nan))


def _brackets(changes: BoolArray, s: FloatArray) -> tuple[FloatArray, FloatArray, IntArray]:
    """Return the bounds and row indices of the first change in each row that has a change."""
    rows = np.flatnonzero(changes.any(1))
    part = changes[rows].argmax(1)
    return s[part], s[part + 1], rows


def _bisected(
    is_on: Callable[[FloatArray], BoolArray], low: FloatArray, high: FloatArray
) -> FloatArray:
    """Bisect intervals (N,) in which a condition changes, and return their lower ends."""
    before = is_on(low)
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        same = is_on(middle) == before
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return low
