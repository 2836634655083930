"""The number of freedoms that a chain gives its tool: the rank of its Jacobian."""

import numpy as np
from numpy.typing import NDArray

from ...model.tolerances import JACOBIAN_RANK
from .lines import Lines

_POSTURES = 3


def of_chain(lines: Lines) -> int:
    """The largest rank of the Jacobian over random postures."""
    rng = np.random.default_rng(0)
    postures = rng.uniform(-np.pi, np.pi, (_POSTURES, len(lines.axes)))
    return max(int(np.linalg.matrix_rank(_jacobian(lines, q), tol=JACOBIAN_RANK)) for q in postures)


def _jacobian(lines: Lines, q: NDArray[np.float64]) -> NDArray[np.float64]:
    """Screws (v; omega) of the axes in a posture; lengths in parts of the arm's."""
    R, t = np.eye(3), np.zeros(3)
    size = lines.length or 1.0
    columns = []
    for axis, value in zip(lines.axes, q, strict=True):
        h = R @ axis.direction
        if axis.turns:
            point = R @ (axis.origin / size) + t
            columns.append(np.concatenate([np.cross(point, h), h]))
            turn = rotation(axis.direction, value)
            t = t + R @ (axis.origin / size - turn @ (axis.origin / size))
            R = R @ turn
        else:
            columns.append(np.concatenate([h, np.zeros(3)]))
            t = t + h * value
    return np.array(columns).T


def rotation(k: NDArray[np.float64], angle: float) -> NDArray[np.float64]:
    """The rotation matrix about a unit vector (Rodrigues)."""
    K = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K)
