"""Singularity measures of parallel robots."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import FloatArray
from ..call.capabilities import needs
from ..tolerances import SINGULAR
from .characteristic_length import LengthMethods


class Singularity(NamedTuple):
    """Distances from three types of singularity: 0 at a singularity, about 1 far away.

    Attributes:
        type_1: (...,) smallest singular value of J_q: at 0 the platform loses a degree of freedom
            (a leg is stretched or folded, at the workspace boundary).
        type_2: (...,) smallest singular value of J_x: at 0 the platform gains a degree of freedom
            (the platform can move with locked actuators, and two assembly modes meet).
        type_3: (...,) the larger of type_1 and type_2: at 0, both types of singularity coincide.
    """

    type_1: FloatArray
    type_2: FloatArray
    type_3: FloatArray

    @property
    def kind(self) -> NDArray[np.int64]:
        """(...,) the type of singularity, 1, 2 or 3, for distances up to 1e-6; else 0."""
        one, two = self.type_1 <= SINGULAR, self.type_2 <= SINGULAR
        return np.where(one & two, 3, np.where(two, 2, np.where(one, 1, 0)))[()]


class SingularityMethods(LengthMethods):
    """Methods of robots with a velocity relation."""

    @needs("velocity_relation")
    def singularity(
        self, theta: ArrayLike, q: ArrayLike, *, characteristic_length: float | None = None
    ) -> Singularity:
        """Return distances from singularities of type 1, 2 and 3.

        The distances are computed from `J_x x' = J_q q'`. Each row of J_x contains the line
        coordinates (n, r x n) of a rod; the angular entries are lever arms. The angular columns of
        J_x, and the columns of J_q for revolute actuators, are divided by the characteristic
        length, so that all matrix entries are dimensionless.

        Args:
            theta: (..., n_theta) main-chain joints [rad or m].
            q: (..., n) actuated coordinates [rad or m] at the same pose.
            characteristic_length: The length [m]; `robot.characteristic_length` if None.

        Returns:
            `type_1`, `type_2`, `type_3`, each (...,), dimensionless, or NaN if a loop is open.

        Raises:
            InputValueError: If the length is not positive.

        Source:
            Gosselin and Angeles, Singularity analysis of closed-loop kinematic chains, 1990.
        """
        J_x, J_q = self._pure_relation("singularity", theta, q, characteristic_length)
        type_1, type_2 = _smallest(J_q), _smallest(J_x)
        return Singularity(type_1, type_2, np.maximum(type_1, type_2))

    def _pure_relation(
        self, name: str, theta: ArrayLike, q: ArrayLike, length: float | None
    ) -> tuple[FloatArray, FloatArray]:
        relation = self.manifest.with_role("velocity relation", "chain")
        assert relation is not None
        length = self._checked_length(name, length)
        J_x, J_q = self.functions["velocity_relation"](theta, q)
        turning = np.array(relation.role.directions) >= 3  # noqa: PLR2004
        unit_x = np.where(turning, length, 1.0)
        unit_q = np.array([length if c.kind == "revolute" else 1.0 for c in self.coordinates])
        return J_x / unit_x, J_q / unit_q


def _smallest(J: FloatArray) -> FloatArray:
    sound = np.asarray(np.isfinite(J).all((-2, -1)))
    values = np.linalg.svd(np.where(sound[..., None, None], J, 0.0), compute_uv=False)
    return np.where(sound, values[..., -1], np.nan)[()]
