"""Poses and Jacobians in numbers of robots whose loops have no closed form.

All configurations at once follow the straight line from the reference in some stations, with a few
steps of Newton's iteration at each.
"""

import numpy as np
from numpy.typing import NDArray

from ...loops.iterated.closure_equations import LoopClosure
from ...loops.platforms import of_open_chain
from ...model.tolerances import FOUND_LOOP
from ...terms.casadi_graph import lower

FloatArray = NDArray[np.float64]
STATIONS, STEPS, LAST_STEPS = 4, 2, 4
"""Points of the way, and steps at each and at its end: coordinates that need more count as not led,
as those beside a singularity do."""


class Followed:
    """The main chain and the tool at actuated coordinates, by iteration."""

    def __init__(self, closure: LoopClosure) -> None:
        """Lowers the equations of the loops and the pose of the main chain's tool."""
        self.closure = closure
        h = closure.hybrid
        self.equations, self.pose = lower(
            [closure.residual, of_open_chain("fk_jacobian_mixed", h)], "followed"
        )
        self.chain = [closure.names.index(joint.name) for joint in h.robot.moving]

    def theta(self, q: FloatArray) -> FloatArray:
        """(N, n_theta) joints of the main chain at coordinates (N, n)."""
        return np.asarray(self._closed(q)[0][:, self.chain])

    def posed(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Poses (N, 4, 4) and mixed Jacobians (N, 6, n) at coordinates (N, n)."""
        w, D = self._closed(q)
        given, unknown = self.closure.given, self.closure.unknown
        slope = np.zeros((len(q), w.shape[1], q.shape[1]))
        slope[:, given] = np.diag(self.closure.ratios)
        slope[:, unknown] = -_solved(D[..., unknown], D @ slope)
        found = zip(self.pose(w[:, self.chain].T), (4, 6), strict=True)
        T, J = (np.array(of).T.reshape(len(q), rows, -1) for of, rows in found)
        return T, J @ slope[:, self.chain]

    def _closed(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Variables (N, W), NaN where they are not reached, and derivatives (N, M, W)."""
        start, unknown = self.closure.start, self.closure.unknown
        w = np.repeat(start.w[None], len(q), 0)
        for k in range(1, STATIONS + 1):
            way = start.q + k / STATIONS * (q - start.q)
            w[:, self.closure.given] = way * self.closure.ratios
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
    """The least-squares solutions of many systems, NaN where a matrix is not finite."""
    found = np.full((len(A), A.shape[-1], b.shape[-1]), np.nan)
    sound = np.isfinite(A).all((-2, -1)) & np.isfinite(b).all((-2, -1))
    found[sound] = np.linalg.pinv(A[sound]) @ b[sound]
    return found
