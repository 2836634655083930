"""Numeric poses and Jacobians of robots whose loops have no closed form.

In the space of actuated coordinates, a straight line connects the reference configuration with each
sampled configuration. Newton's method closes the loops at several points on each straight line,
with a few steps at each point. Newton's method follows the straight lines of all sampled
configurations at the same time.
"""

import numpy as np
from numpy.typing import NDArray

from ...loops.iterated.closure_equations import RESIDUAL, LoopClosure
from ...loops.modes.platforms import of_open_chain
from ...model.tolerances import FOUND_LOOP
from ...terms.casadi_graph import lower

FloatArray = NDArray[np.float64]
STATIONS, STEPS, LAST_STEPS = 4, 2, 4
"""Number of points on the line from the reference to a configuration, number of Newton steps at
each point before the last, and number at the last point. If Newton's method needs more than
LAST_STEPS steps at the last point, for example near a singularity, the configuration counts as not
converged."""


class Followed:
    """Computes main-chain joints and tool poses from actuated coordinates by iteration."""

    def __init__(self, closure: LoopClosure) -> None:
        self.closure = closure
        h = closure.hybrid
        self.equations, self.pose = lower(
            [closure.functions[RESIDUAL], of_open_chain("fk_jacobian_mixed", h)], "followed"
        )
        self.chain = [closure.names.index(joint.name) for joint in h.robot.moving]

    def theta(self, q: FloatArray) -> FloatArray:
        """Return the main-chain joints (N, n_theta) at actuated coordinates (N, n)."""
        return np.asarray(self._closed(q)[0][:, self.chain])

    def posed(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return poses (N, 4, 4) and mixed Jacobians (N, 6, n) at actuated coordinates (N, n)."""
        w, D = self._closed(q)
        given, unknown = self.closure.given, self.closure.unknown
        slope = np.zeros((len(q), w.shape[1], q.shape[1]))
        slope[:, given] = np.diag(self.closure.ratios)
        slope[:, unknown] = -_solved(D[..., unknown], D @ slope)
        found = zip(self.pose(w[:, self.chain].T), (4, 6), strict=True)
        T, J = (np.array(of).T.reshape(len(q), rows, -1) for of, rows in found)
        return T, J @ slope[:, self.chain]

    def _closed(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the loop variables (N, W) and the derivatives (N, M, W) of the loop equations.

        The loop variables are NaN if the iteration does not converge.
        """
        start, unknown = self.closure.start, self.closure.unknown
        w = np.repeat(start.w[None], len(q), 0)
        for k in range(1, STATIONS + 1):
            station = start.q + k / STATIONS * (q - start.q)
            w[:, self.closure.given] = station * self.closure.ratios
            for _ in range(STEPS if k < STATIONS else LAST_STEPS):
                c, D = self._evaluated(w)
                w[:, unknown] -= _solved(D[..., unknown], c[..., None])[..., 0]
        c, D = self._evaluated(w)
        w[~(np.abs(c).max(-1) <= FOUND_LOOP)] = np.nan
        return w, D

    def _evaluated(self, w: FloatArray) -> tuple[FloatArray, FloatArray]:
        c, D = (np.array(of).T for of in self.equations(w.T))
        return c, D.reshape(len(w), c.shape[1], -1)


def _solved(A: FloatArray, b: FloatArray) -> FloatArray:
    found = np.full((len(A), A.shape[-1], b.shape[-1]), np.nan)
    sound = np.isfinite(A).all((-2, -1)) & np.isfinite(b).all((-2, -1))
    found[sound] = np.linalg.pinv(A[sound]) @ b[sound]
    return found
