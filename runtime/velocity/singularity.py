"""Distances of a parallel robot from its singularities."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import FloatArray
from ..call.capabilities import needs
from ..tolerances import SINGULAR
from .characteristic_length import LengthMethods


class Singularity(NamedTuple):
    """Distances from the three kinds of singularity; 0 at one, of order 1 far from all.

    Attributes:
        type_1: (...,) smallest singular value of J_q: at 0 the platform loses a freedom (a leg is
            stretched or folded, the border of the workspace).
        type_2: (...,) smallest singular value of J_x: at 0 the platform gains a freedom (locked
            actuators do not hold it, two assembly modes meet).
        type_3: (...,) the larger of both: at 0 both happen at once.
    """

    type_1: FloatArray
    type_2: FloatArray
    type_3: FloatArray

    @property
    def kind(self) -> NDArray[np.int64]:
        """(...,) the type of the singularity, 1, 2 or 3; 0 where there is none.

        A distance up to 1e-6 counts as none.
        """
        one, two = self.type_1 <= SINGULAR, self.type_2 <= SINGULAR
        return np.where(one & two, 3, np.where(two, 2, np.where(one, 1, 0)))[()]


class SingularityMethods(LengthMethods):
    """The methods of a robot with a velocity relation."""

    @needs("velocity_relation")
    def singularity(
        self, theta: ArrayLike, q: ArrayLike, *, characteristic_length: float | None = None
    ) -> Singularity:
        """Distances from singularities of type 1, 2 and 3, from `J_x x' = J_q q'`.

        A row of J_x is the line (n, r x n) of a rod, so that the columns of angular rates hold
        lever arms. These columns, and the columns of J_q of revolute actuators, are divided by the
        characteristic length, which makes all entries pure numbers. The length must not depend on
        the pose: divided by their own mean, the lever arms would not vanish where all lines meet in
        the platform's origin, a singularity of type 2.

        Args:
            theta: (..., n_theta) main-chain joints [rad or m].
            q: (..., n) actuated coordinates [rad or m], of the same pose.
            characteristic_length: The length [m]; `robot.characteristic_length` if None.

        Returns:
            `type_1`, `type_2`, `type_3`, each (...,), pure numbers; NaN where a loop is open.

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
        """J_x and J_q, the columns of angular directions divided by a length."""
        relation = self.manifest.with_role("velocity relation", "chain")
        assert relation is not None
        length = self._checked_length(name, length)
        J_x, J_q = self.functions["velocity_relation"](theta, q)
        turning = np.array(relation.role.directions) >= 3  # noqa: PLR2004
        unit_x = np.where(turning, length, 1.0)
        unit_q = np.array([length if c.kind == "revolute" else 1.0 for c in self.coordinates])
        return J_x / unit_x, J_q / unit_q


def _smallest(J: FloatArray) -> FloatArray:
    """The smallest singular value, NaN where an entry is not finite."""
    sound = np.asarray(np.isfinite(J).all((-2, -1)))
    values = np.linalg.svd(np.where(sound[..., None, None], J, 0.0), compute_uv=False)
    return np.where(sound, values[..., -1], np.nan)[()]
