"""Parallel singularities: determinants, distances along lines, and curves in a plane."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import BoolArray, FloatArray, IntArray
from ..call.capabilities import needs
from ..closed_form.closures import LoopMethods, has_leg_inverse, is_planar_with_inverse
from ..errors import InputValueError
from ..summaries import summary_repr
from .contours import bisected, zero_curves
from .singularity import SingularityMethods

_SAMPLES = 512
_RAYS, _RADII = 128, np.geomspace(1e-3, 1e3, 281)
_PAD = 0.05
"""Spacing of the sampled radii and rays, relative to the radius."""


class Determinants(NamedTuple):
    """Dimensionless determinants of the velocity relation J_x x' = J_q q'.

    Attributes:
        J_x: (...,) determinant of J_x, which changes sign at a singularity of type 2.
        J_q: (...,) determinant of J_q, or sqrt(det(J_q^T J_q)) for a rectangular J_q. It is 0 at a
            singularity of type 1.
    """

    J_x: FloatArray
    J_q: FloatArray


class SingularityDistance(NamedTuple):
    """Distances from a pose to singularities, as multiples of a direction; inf if there are none.

    Attributes:
        type_1: (...,) distance at which a leg is stretched or folded.
        type_2: (...,) distance at which the platform gains a degree of freedom.
    """

    type_1: FloatArray
    type_2: FloatArray


class SingularityCurves(NamedTuple):
    """Polylines (k, 2) of singular positions x, y [m] at one orientation.

    Attributes:
        type_1: Curves on which a leg is stretched or folded.
        type_2: Curves on which the platform gains a degree of freedom.
    """

    type_1: tuple[FloatArray, ...]
    type_2: tuple[FloatArray, ...]

    def __repr__(self) -> str:
        """Return the number of curves of each type."""
        facts = (f"{len(self.type_1)} of type 1", f"{len(self.type_2)} of type 2")
        return summary_repr(self, "", *facts, methods="type_1, type_2")


class SingularWayMethods(LoopMethods, SingularityMethods):
    """Methods of robots with a velocity relation and a leg inverse."""

    @needs("velocity_relation")
    def determinants(
        self, theta: ArrayLike, q: ArrayLike, *, characteristic_length: float | None = None
    ) -> Determinants:
        """Return the determinants `J_x (...,)` and `J_q (...,)`; NaN if a loop is open.

        The Jacobians, the arguments and the errors are those of `singularity`.
        """
        J_x, J_q = self._pure_relation("determinants", theta, q, characteristic_length)
        return Determinants(_determinant(J_x)[()], _determinant(J_q)[()])

    @needs("velocity_relation", when=has_leg_inverse)
    def distance_to_singularity(
        self, theta: ArrayLike, direction: ArrayLike, q: ArrayLike | None = None
    ) -> SingularityDistance:
        """Return the distances to the first singularities along a line theta + s direction.

        The range 0 < s <= 1 is sampled in 512 intervals. The first interval in which a determinant
        changes sign or a leg loses reach is bisected to double precision. Two singularities in one
        interval are missed. The legs stay on their branches.

        Args:
            theta: (..., n_theta) main-chain joints at the start [rad or m].
            direction: (..., n_theta) displacement for s = 1 [rad or m].
            q: (..., n) actuated coordinates at the start, which select the leg branches; the
                branches of the reference configuration if None.

        Returns:
            `type_1 (...,)` and `type_2 (...,)`: the smallest s, inf without a singularity up to
            s = 1; NaN if the start is out of reach.
        """
        method, n = "distance_to_singularity", len(self.chain_joints)
        start = self._reals(method, "theta", theta, (n,))
        start, way = np.broadcast_arrays(start, self._reals(method, "direction", direction, (n,)))
        batch, start, way = start.shape[:-1], start.reshape(-1, n), way.reshape(-1, n)
        slots = self._slots(start, q)
        rows = np.arange(len(start))

        def f(s: FloatArray, at: IntArray) -> tuple[FloatArray, FloatArray]:
            there = start[at] + s[:, None] * way[at]
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
        type_1[at] = bisected(lambda x: f(x, at)[0] >= 0, low, high)
        # The last interval may contain both singularities.
        turned = (determinant[:, 1:] > 0) != (determinant[:, :-1] > 0)
        turned[at, leaves[at].argmax(1)] = (f(type_1[at], at)[1] > 0) != (f(low, at)[1] > 0)
        type_2 = np.full(len(start), np.inf)
        low, high, at = _brackets(turned, s)
        high = np.minimum(high, type_1[at])
        type_2[at] = bisected(lambda x: f(x, at)[1] > 0, low, high)
        # No pose exists beyond the boundary of leg reach.
        type_2[type_2 > type_1] = np.inf
        for found in (type_1, type_2):
            found[~reached[:, 0]] = np.nan
        return SingularityDistance(type_1.reshape(batch)[()], type_2.reshape(batch)[()])

    @needs("velocity_relation", when=is_planar_with_inverse)
    def singularity_curves(
        self,
        phi: float,
        x: Sequence[float] | None = None,
        y: Sequence[float] | None = None,
        *,
        slot: int = 0,
        resolution: int = 201,
    ) -> SingularityCurves:
        """Return the singular positions of a planar platform at one orientation.

        The curves connect zeros of the determinants on grid lines by straight segments.

        Args:
            phi: The platform angle [rad].
            x: Lower and upper bound of x [m]; by default the bounds of the common leg reach.
            y: Lower and upper bound of y [m]; by default as for x.
            slot: The leg branches, a slot of `ik_planar`; 0 is the reference branch.
            resolution: Number of grid lines per axis.

        Returns:
            `type_1` and `type_2`, polylines (k, 2) of x and y [m]; type-2 curves end at the
            boundary of leg reach.

        Raises:
            InputValueError: If bounds do not ascend, if the resolution is below 2, or if x or y is
                None and the leg reach is unbounded.
        """
        if x is None or y is None:
            reach = self._reach(phi, slot)
            if not len(reach):
                return SingularityCurves((), ())
            x, y = reach[0] if x is None else x, reach[1] if y is None else y
        if not (x[0] < x[1] and y[0] < y[1] and resolution >= 2):  # noqa: PLR2004
            raise InputValueError(
                f"{self.name}.singularity_curves: x and y must ascend and resolution be at least 2"
            )
        grid = [np.linspace(low, high, resolution) for low, high in (x, y)]

        def at(position: FloatArray) -> tuple[FloatArray, FloatArray]:
            pose = np.concatenate([position, np.full((*position.shape[:-1], 1), phi)], -1)
            rows = pose.reshape(-1, 3)
            margins, determinant = self._values(rows, np.full(len(rows), slot))
            shape = position.shape[:-1]
            return margins.reshape(*shape, -1), determinant.reshape(shape)

        legs = at(np.zeros((1, 2)))[0].shape[-1]
        type_1 = [zero_curves(lambda p, k=leg: at(p)[0][..., k], *grid) for leg in range(legs)]  # type: ignore[misc]
        type_2 = zero_curves(lambda p: at(p)[1], *grid)
        return SingularityCurves(tuple(curve for found in type_1 for curve in found), type_2)

    def _reach(self, phi: float, slot: int) -> list[tuple[float, float]]:
        """Return bounds of x and y for the common leg reach, [] if it is empty."""
        angle = np.linspace(0, 2 * np.pi, _RAYS, endpoint=False)
        radius = self.unit_length * _RADII[:, None]
        away = np.stack([radius * np.cos(angle), radius * np.sin(angle)], -1).reshape(-1, 2)
        theta = np.column_stack([self._reference_theta()[:2] + away, np.full(len(away), phi)])
        q, margin = (part[:, slot] for part in self._branches(theta))
        turns = [c.unit == "rad" for c in self.coordinates]
        within = turns | (q >= self.lower) & (q <= self.upper)
        reached = np.asarray((margin >= 0).all(-1) & within.all(-1))
        if reached[-_RAYS:].any():
            raise InputValueError(f"{self.name}.singularity_curves: unbounded reach: pass x and y")
        if not reached.any():
            return []
        pad = _PAD * np.linalg.norm(away[reached], axis=1).max()
        found = theta[reached, :2]
        return list(zip(found.min(0) - pad, found.max(0) + pad, strict=True))

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
        """Return leg margins (N, legs) and determinants of J_x (N,)."""
        q, margin = self._branches(theta)
        rows = np.arange(len(theta))
        J_x, _ = self._pure_relation("determinants", theta, q[rows, slots], None)
        return margin[rows, slots], _determinant(J_x)


def _determinant(J: FloatArray) -> FloatArray:
    """Return det(J), or sqrt(det(J^T J)) for more rows than columns; NaN if J is not finite."""
    sound = np.asarray(np.isfinite(J).all((-2, -1)))
    J = np.where(sound[..., None, None], J, 0.0)
    if J.shape[-2] == J.shape[-1]:
        found = np.linalg.det(J)
    else:
        found = np.sqrt(np.maximum(np.linalg.det(np.swapaxes(J, -1, -2) @ J), 0.0))
    return np.asarray(np.where(sound, found, np.nan))


def _brackets(changes: BoolArray, s: FloatArray) -> tuple[FloatArray, FloatArray, IntArray]:
    """Return the ends of the first interval with a change, and the indices of changed rows."""
    rows = np.flatnonzero(changes.any(1))
    part = changes[rows].argmax(1)
    return s[part], s[part + 1], rows
