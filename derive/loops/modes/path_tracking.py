"""Path tracking of complex poses between two rod sets that share ends a or b.

The coefficients change along a straight line with t from 0 to 1. A Runge-Kutta step and two Newton
steps update each pose. Between generic complex coefficients no path meets a singularity. If the
final rod set is not generic, a path may end at a singularity or at infinity.

Source:
    Sommese and Wampler 2005, The Numerical Solution of Systems of Polynomials, ch. 2 and 7.
"""

import numpy as np

from ...model.tolerances import PATH_NEAR, PATH_ON, SHORTEST_PATH_STEP
from .soma import SOMA, Array, SixRods, quadrics

FIRST_STEP = 0.05
MAX_STEPS = 3000


def followed(start: SixRods, end: SixRods, x: Array) -> tuple[Array, Array]:
    """Tracks poses from the start rod set to the end rod set.

    Args:
        start: Rods with known poses; they share a or b with the end rods.
        end: Rods at the end of the path.
        x: (n, 8) poses of the start rods.

    Returns:
        (n, 8) unit poses, and (n,) flags for the paths that reached the end.
    """
    H, change = quadrics(start), quadrics(end) - quadrics(start)
    x = x / np.linalg.norm(x, axis=1, keepdims=True)
    t, h = np.zeros(len(x)), np.full(len(x), FIRST_STEP)
    going = np.ones(len(x), bool)
    for _ in range(MAX_STEPS):
        rows = np.flatnonzero(going & (t < 1))
        if not len(rows):
            break
        step = np.minimum(h[rows], 1 - t[rows])
        y, first, second = _stepped(H, change, x[rows], t[rows], step)
        holds = (first < PATH_NEAR) & (second < PATH_ON)
        factor = np.clip(0.8 * (PATH_NEAR / np.maximum(first, PATH_ON**2)) ** 0.2, 0.25, 2.0)
        done = rows[holds]
        x[done] = y[holds]
        t[done] = np.where(step == 1 - t[rows], 1.0, t[rows] + step)[holds]
        h[rows] = step * np.where(holds, factor, np.minimum(factor, 0.5))
        going[rows] = h[rows] > SHORTEST_PATH_STEP
    return x, np.asarray(t == 1)


def _stepped(H: Array, change: Array, x: Array, t: Array, h: Array) -> tuple[Array, Array, Array]:
    """Returns the poses after one tracking step, and the norms of both Newton corrections."""

    def slope(part: float, y: Array) -> Array:
        _, J = _linear(H, change, t + part * h, y, x)
        return _solved(J, -np.einsum("kij,ni,nj->nk", change, y, y))

    H_t = h[:, None]
    k1 = slope(0.0, x)
    k2 = slope(0.5, x + H_t / 2 * k1)
    k3 = slope(0.5, x + H_t / 2 * k2)
    k4 = slope(1.0, x + H_t * k3)
    y = x + H_t / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    lengths = []
    for _ in range(2):
        Hy, J = _linear(H, change, t + h, y, x)
        correction = _solved(J, -np.einsum("nki,ni->nk", Hy, y))
        y = y + correction
        lengths.append(np.linalg.norm(correction, axis=1))
    return y / np.linalg.norm(y, axis=1, keepdims=True), lengths[0], lengths[1]


def _linear(H: Array, change: Array, t: Array, y: Array, of: Array) -> tuple[Array, Array]:
    """Returns H(t) y, and the Jacobian with a last row that keeps steps normal to `of`."""
    Hy = np.einsum("kij,nj->nki", H, y) + t[:, None, None] * np.einsum("kij,nj->nki", change, y)
    J = np.empty((len(y), SOMA, SOMA), np.complex128)
    J[:, :-1] = 2 * Hy
    J[:, -1] = of.conj()
    return Hy, J


def _solved(J: Array, right: Array) -> Array:
    padded = np.concatenate([right, np.zeros((len(right), 1))], 1)[..., None]
    try:
        return np.asarray(np.linalg.solve(J, padded)[..., 0])
    except np.linalg.LinAlgError:
        # A pose of the batch is exactly singular, for example at infinity.
        return np.asarray((np.linalg.pinv(J) @ padded)[..., 0])


def condition(rods: SixRods, x: Array) -> Array:
    """Returns the condition numbers (n,) of the equations' Jacobian at unit poses."""
    _, J = _linear(quadrics(rods), np.zeros((7, SOMA, SOMA)), np.zeros(len(x)), x, x)
    return np.asarray(np.linalg.cond(J))
