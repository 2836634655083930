"""Saddles of the squared error, at which iteration stands still, and the ways down from them.

Where two solutions nearly merge, f = |e|^2 / 2 has a saddle between them: its gradient -J^T e is 0,
but the error is not. The direction of the least curvature of f leads on, both ways.

Source:
    Nocedal and Wright, Numerical Optimization, 2006, section 3.4.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..arrays import FloatArray, IntArray
from ..tolerances import SADDLE, SADDLE_BEND, SADDLE_STEP

Gradients = Callable[[IntArray, FloatArray], tuple[FloatArray, FloatArray]]
"""From the numbers (N,) of targets and coordinates (N, n) to f (N,) and its gradients (N, n)."""
_LONGEST = 1.0
"""Radians or lengths of the way to a start at most."""


class Ways(NamedTuple):
    """Starts on both sides of saddles.

    Attributes:
        row: (M,) the rows of the coordinates that are at saddles, each of them twice.
        q: (M, n) the starts.
    """

    row: IntArray
    q: FloatArray


def ways_down(gradients: Gradients, q: FloatArray, free: list[int]) -> Ways:
    """Starts on both sides of those coordinates that are at a saddle of the squared error.

    The way leads to where the error would vanish if the curvature stayed as it is.
    """
    f, g = gradients(np.arange(len(q)), q)
    error = np.sqrt(2 * f)
    row = np.flatnonzero(np.abs(g[:, free]).max(-1) <= SADDLE * error)
    H = _hessian(gradients, row, q[row], free)
    # Beside a dead point loops do not close on all sides of the coordinates.
    closes = np.isfinite(H).all((1, 2))
    row, H = row[closes], H[closes]
    curvatures, directions = np.linalg.eigh(H)
    fall = -curvatures[:, 0] / error[row]
    down = fall > SADDLE_BEND
    row, way = row[down], np.zeros((np.count_nonzero(down), q.shape[1]))
    length = np.minimum(np.sqrt(error[row] / fall[down]), _LONGEST)
    way[:, free] = length[:, None] * directions[down, :, 0]
    return Ways(np.tile(row, 2), np.concatenate([q[row] + way, q[row] - way]))


def _hessian(gradients: Gradients, row: IntArray, q: FloatArray, free: list[int]) -> FloatArray:
    """The second derivatives (N, m, m) of f by the free coordinates."""
    step = SADDLE_STEP * np.eye(q.shape[1])[free]
    around = (q[:, None] + np.concatenate([step, -step])).reshape(-1, q.shape[1])
    g = gradients(np.repeat(row, 2 * len(free)), around)[1][:, free]
    ahead, behind = g.reshape(len(q), 2, len(free), len(free)).swapaxes(0, 1)
    H = (ahead - behind) / (2 * SADDLE_STEP)
    return np.asarray((H + H.mT) / 2)
