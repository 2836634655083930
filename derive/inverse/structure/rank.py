"""Rank of the Jacobian of an arm."""

from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

from ...model.tolerances import JACOBIAN_RANK
from .lines import Lines, rotation

_CONFIGURATIONS = 3
_QUARTERS = tuple(k * np.pi / 2 for k in range(4))


def of_chain(lines: Lines) -> int:
    """Returns the largest rank of the Jacobian at random configurations."""
    return max(int(np.linalg.matrix_rank(J, tol=JACOBIAN_RANK)) for J in jacobians(lines))


def jacobians(lines: Lines) -> list[NDArray[np.float64]]:
    """Returns Jacobians (6, n) at random configurations. Lengths are relative to the arm length."""
    return [_jacobian(lines, q)[0] for q in _random_configurations(lines)]


def moves_in_space(lines: Lines, point: NDArray[np.float64]) -> bool:
    """Whether the joints of a chain move a point in three directions.

    Args:
        lines: The chain.
        point: The point in the home pose (meter).
    """
    return any(_directions(lines, point, q) == 3 for q in _random_configurations(lines))  # noqa: PLR2004


def directions_at_right_angles(lines: Lines, point: NDArray[np.float64]) -> int:
    """Sums the ranks of the Jacobian of a point over right-angle configurations.

    A point on the axis of a joint has a lower sum of ranks than other points.

    Args:
        lines: The chain.
        point: The point in the home pose (meter).
    """
    values = [_QUARTERS if axis.turns else (0.0,) for axis in lines.axes]
    rates = np.array([_rates(lines, point, np.array(q)) for q in product(*values)])
    joints = range(len(lines.axes))
    sets = [chosen for count in joints for chosen in combinations(joints, count + 1)]
    ranks = [np.linalg.matrix_rank(rates[..., chosen], tol=JACOBIAN_RANK) for chosen in sets]
    return int(np.sum(ranks))


def _directions(lines: Lines, point: NDArray[np.float64], q: NDArray[np.float64]) -> int:
    return int(np.linalg.matrix_rank(_rates(lines, point, q), tol=JACOBIAN_RANK))


def _rates(lines: Lines, point: NDArray[np.float64], q: NDArray[np.float64]) -> NDArray[np.float64]:
    size = lines.length or 1.0
    J, R, t = _jacobian(lines, q)
    there = R @ (point / size) + t
    return np.asarray(J[:3] + np.cross(J[3:], there, axis=0))


def _random_configurations(lines: Lines) -> NDArray[np.float64]:
    rng = np.random.default_rng(0)
    return rng.uniform(-np.pi, np.pi, (_CONFIGURATIONS, len(lines.axes)))


def _jacobian(
    lines: Lines, q: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
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
    return np.array(columns).T, R, t
