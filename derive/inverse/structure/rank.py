"""Rank of the Jacobian of an arm."""

from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

from ...model.tolerances import JACOBIAN_RANK
from .lines import Lines, rotation

_CONFIGURATIONS = 3
_QUARTERS = tuple(k * np.pi / 2 for k in range(4))


def of_chain(lines: Lines) -> int:
    """Return the largest rank of the Jacobian of a chain over random configurations."""
    return max(int(np.linalg.matrix_rank(J, tol=JACOBIAN_RANK)) for J in jacobians(lines))


def jacobians(lines: Lines) -> list[NDArray[np.float64]]:
    """Return the Jacobians (6, n) of a chain at random configurations."""
    return [*_jacobian(lines, _random_configurations(lines))[0]]


def moves_in_space(lines: Lines, point: NDArray[np.float64]) -> bool:
    """Whether the joints of a chain move a point in three directions.

    Args:
        lines: The chain.
        point: The point in the home pose (meter).
    """
    rates = _rates(lines, point, _random_configurations(lines))
    return bool(np.max(np.linalg.matrix_rank(rates, tol=JACOBIAN_RANK)) == 3)  # noqa: PLR2004


def directions_at_right_angles(lines: Lines, point: NDArray[np.float64]) -> int:
    """Sum the ranks of a point's Jacobian over all joint angles that are multiples of 90 degrees.

    At each configuration, the sum includes the rank of the Jacobian columns of every subset of the
    joints.

    The sum of ranks is smaller for points on a joint axis than for other points.

    Args:
        lines: The chain.
        point: The point in the home pose (meter).
    """
    values = [_QUARTERS if axis.turns else (0.0,) for axis in lines.axes]
    rates = _rates(lines, point, np.array([*product(*values)]))
    joints = range(len(lines.axes))
    sets = [chosen for count in joints for chosen in combinations(joints, count + 1)]
    ranks = [np.linalg.matrix_rank(rates[..., chosen], tol=JACOBIAN_RANK) for chosen in sets]
    return int(np.sum(ranks))


def _rates(lines: Lines, point: NDArray[np.float64], q: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the Jacobians (..., 3, n) of a point at joint values q (..., n)."""
    size = lines.length or 1.0
    J, R, t = _jacobian(lines, q)
    there = R @ (point / size) + t
    return np.asarray(J[..., :3, :] + np.cross(J[..., 3:, :], there[..., None], axis=-2))


def _random_configurations(lines: Lines) -> NDArray[np.float64]:
    rng = np.random.default_rng(0)
    return rng.uniform(-np.pi, np.pi, (_CONFIGURATIONS, len(lines.axes)))


def _jacobian(
    lines: Lines, q: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return Jacobians (..., 6, n), rotations (..., 3, 3) and positions (..., 3) of the tool.

    Args:
        lines: The chain.
        q: Joint values (..., n).
    """
    R, t = np.broadcast_to(np.eye(3), (*q.shape[:-1], 3, 3)), np.zeros((*q.shape[:-1], 3))
    size = lines.length or 1.0
    J = np.zeros((*q.shape[:-1], 6, len(lines.axes)))
    for k, axis in enumerate(lines.axes):
        h, value = R @ axis.direction, q[..., k, None]
        if axis.turns:
            origin = axis.origin / size
            J[..., :3, k], J[..., 3:, k] = np.cross(R @ origin + t, h), h
            turn = rotation(axis.direction, value[..., None])
            t = t + (R @ (origin - turn @ origin)[..., None])[..., 0]
            R = R @ turn
        else:
            J[..., :3, k] = h
            t = t + h * value
    return J, R, t
