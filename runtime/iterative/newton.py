"""Loop configurations without a closed form, by Newton's method in C."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import BoolArray, FloatArray, real_array
from ..call.capabilities import needs
from ..errors import ShapeError
from ..facts import RobotFacts


class LoopSolution(NamedTuple):
    """Configurations with closed loops.

    Attributes:
        z: (..., n_z) configurations. NaN without convergence.
        valid: (...,) whether the iteration converged.
        residual: (...,) largest constraint residual [m, rad]. NaN without convergence.
    """

    z: FloatArray
    valid: BoolArray
    residual: FloatArray

    @property
    def n_failed(self) -> int:
        """The number of coordinate vectors q without a solution."""
        return int(np.size(self.valid) - np.count_nonzero(self.valid))


class NewtonMethods(RobotFacts):
    """Methods of robots whose loops have no closed-form solution."""

    @needs("configuration_near", "constraint", when=lambda robot: robot.manifest.is_iterated)
    def solve_loops(self, q: ArrayLike, z_seed: ArrayLike | None = None) -> LoopSolution:
        """Solve the loops at actuated coordinates by Newton's iteration.

        Args:
            q: (..., n) actuated coordinates [rad or m].
            z_seed: (..., n_z) nearby configurations, such as the previous solutions. If None, the
                iteration follows the straight line in q from the reference configuration.

        Returns:
            `z (..., n_z)`, `valid (...,)`, `residual (...,)` and `n_failed`. Missing solutions do
            not raise an error.
        """
        # A single input without a solution raises an error, but an input in a batch does not. The
        # input is therefore passed as a batch of one.
        rows = real_array(f"{self.name}.solve_loops", "q", q)[None]
        z = self.configuration(rows) if z_seed is None else self.configuration_near(rows, z_seed)
        return self._solution(z[0])

    @needs("configuration_near", "constraint", when=lambda robot: robot.manifest.is_iterated)
    def solve_loops_along(self, q: ArrayLike, z_seed: ArrayLike | None = None) -> LoopSolution:
        """Solve the loops along a path. Each step starts from the previous configuration.

        Args:
            q: (k, n) actuated coordinates [rad or m], in order.
            z_seed: (n_z,) a configuration near the first solution, or None; see `solve_loops`.

        Returns:
            The results of `solve_loops` for all k rows of q. If a row fails, all later rows also
            fail, because each row starts from the previous result.
        """
        rows = real_array(label := f"{self.name}.solve_loops_along", "q", q)
        if rows.shape[1:] != (self.n,):
            raise ShapeError(f"{label}: expected q (k, {self.n}), got {rows.shape}")
        z = np.full((len(rows), *self.configuration.outputs[0].shape), np.nan)
        for k, row in enumerate(rows):
            z[k] = z_seed = self.solve_loops(row, z_seed).z
        return self._solution(z)

    def _solution(self, z: FloatArray) -> LoopSolution:
        residual = np.asarray(np.abs(self.constraint(z)).max(-1, initial=0.0))
        return LoopSolution(z, np.asarray(np.isfinite(z).all(-1)), residual)
