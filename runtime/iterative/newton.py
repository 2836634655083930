"""Configurations of loops without a closed-form solution, with what is left of their equations.

The generated functions close the loops by Newton's iteration in C: from the reference configuration
along the straight line in q, or from a configuration nearby.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..call.capabilities import needs
from ..facts import RobotFacts

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


class Continuation(NamedTuple):
    """Configurations that were followed from the reference or from a seed.

    Attributes:
        z: (..., n_z) configurations, NaN where the iteration did not converge.
        valid: (...,) whether it converged.
        residual: (...,) largest entry of the constraint [m, rad], NaN where it did not.
    """

    z: FloatArray
    valid: BoolArray
    residual: FloatArray

    @property
    def n_failed(self) -> int:
        """The number of poses that were not reached."""
        return int(np.size(self.valid) - np.count_nonzero(self.valid))


class NewtonMethods(RobotFacts):
    """The methods of a robot whose loops have no closed-form solution."""

    @needs("configuration_near", "constraint", when=lambda robot: robot.manifest.is_iterated)
    def follow(self, q: ArrayLike, seed: ArrayLike | None = None) -> Continuation:
        """Configurations at actuated coordinates, by Newton's iteration on the loops.

        Args:
            q: (..., n) actuated coordinates [rad or m].
            seed: (..., n_z) configurations nearby, such as those of the step before; each pose is
                then on the branch of its seed, after at most eight linear systems. Without seeds,
                poses are followed from the reference configuration along the straight line in q.

        Returns:
            `z (..., n_z)`, `valid (...,)` and `residual (...,)`, and `n_failed`, the number of
            poses that were not reached. They raise no error.
        """
        q = np.asarray(q)
        # One row more, since a single pose that is not reached would raise.
        rows = q[None]
        z = self.configuration(rows) if seed is None else self.configuration_near(rows, seed)
        return self._continued(z[0])

    @needs("configuration_near", "constraint", when=lambda robot: robot.manifest.is_iterated)
    def follow_path(self, q: ArrayLike, seed: ArrayLike | None = None) -> Continuation:
        """Configurations along a path, each from the one before.

        Args:
            q: (k, n) actuated coordinates [rad or m], in order.
            seed: (n_z,) a configuration near the first pose; without it, the first pose is followed
                from the reference.

        Returns:
            As :meth:`follow`; behind a pose that is not reached, none is.
        """
        rows = np.asarray(q, dtype=np.float64)
        (size,) = self.configuration.outputs[0].shape
        z = np.full((len(rows), size), np.nan)
        for k, row in enumerate(rows):
            z[k] = self.follow(row, seed).z
            seed = z[k]
        return self._continued(z)

    def _continued(self, z: FloatArray) -> Continuation:
        residual = np.asarray(np.abs(self.constraint(z)).max(-1, initial=0.0))
        return Continuation(z, np.asarray(np.isfinite(z).all(-1)), residual)
