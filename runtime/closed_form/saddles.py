"""Descent from saddles of the squared error, at which Newton's iteration stalls.

Where two solutions nearly merge, f = |e|^2 / 2 has a saddle between them: the gradient -J^T e is 0,
but the error is not. The direction of lowest curvature of f leads to both solutions.

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
"""A function of target indices (N,) and coordinates (N, n) with f (N,) and gradients (N, n)."""
_LONGEST = 1.0
"""Maximum distance of a start configuration from the saddle [rad or length]."""


class Ways(NamedTuple):
    """Start configurations q (M, n) on both sides of saddles, and the input row (M,) of each."""

    row: IntArray
    q: FloatArray


def ways_down(gradients: Gradients, q: FloatArray, free: list[int]) -> Ways:
    """Return start configurations on both sides of saddles, with zero error to second order."""
    f, g = gradients(np.arange(len(q)), q)
    error = np.sqrt(2 * f)
    row = np.flatnonzero(np.abs(g[:, free]).max(-1) <= SADDLE * error)
    H = _hessian(gradients, row, q[row], free)
    # Near a dead point, loops may be open at some difference points.
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
    """Return Hessians (N, m, m) of f with respect to the free coordinates."""
    step = SADDLE_STEP * np.eye(q.shape[1])[free]
    around = (q[:, None] + np.concatenate([step, -step])).reshape(-1, q.shape[1])
    g = gradients(np.repeat(row, 2 * len(free)), around)[1][:, free]
    ahead, behind = g.reshape(len(q), 2, len(free), len(free)).swapaxes(0, 1)
    H = (ahead - behind) / (2 * SADDLE_STEP)
    return np.asarray((H + H.mT) / 2)
