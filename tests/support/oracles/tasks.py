"""Tasks of inverse kinematics functions, such as the position or the pose of the tool."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Task:
    """A task of the tool, such as its position or its pose.

    Attributes:
        target: Function from poses (..., 4, 4) to targets.
        error: Function from poses and targets to errors (...), where an error is the larger of
            distance [m] and angle [rad].
        residual: Function from poses and targets to residuals (..., rows), in the order of the
            Jacobian rows.
        jacobian: Function from poses and mixed Jacobians (..., 6, n) to the Jacobian of the task
            (..., rows, n).
    """

    target: Callable[[np.ndarray], np.ndarray]
    error: Callable[[np.ndarray, np.ndarray], np.ndarray]
    residual: Callable[[np.ndarray, np.ndarray], np.ndarray]
    jacobian: Callable[[np.ndarray, np.ndarray], np.ndarray]


def turned(R: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Return the angle (...) between two rotation matrices (..., 3, 3)."""
    between = np.swapaxes(R, -1, -2) @ wanted
    twice = between - np.swapaxes(between, -1, -2)
    sine = np.linalg.norm(twice[..., (2, 0, 1), (1, 2, 0)], axis=-1)
    return np.arctan2(sine, np.trace(between, axis1=-2, axis2=-1) - 1)


def _far(T: np.ndarray, p: np.ndarray) -> np.ndarray:
    return np.linalg.norm(T[..., :3, 3] - p, axis=-1)


def _pitch(T: np.ndarray) -> np.ndarray:
    """Return the elevation of the tool's axis above the plane z = 0."""
    return np.arctan2(T[..., 2, 2], np.hypot(T[..., 0, 2], T[..., 1, 2]))


def _pitch_rates(T: np.ndarray, J: np.ndarray) -> np.ndarray:
    """Return cos(pitch) times the derivatives (..., n) of the tool pitch."""
    return J[..., 3, :] * T[..., 1, 2, None] - J[..., 4, :] * T[..., 0, 2, None]


def _heading(T: np.ndarray) -> np.ndarray:
    return np.arctan2(T[..., 1, 0], T[..., 0, 0])


def wrapped(angle: np.ndarray) -> np.ndarray:
    return angle - 2 * np.pi * np.round(angle / (2 * np.pi))


def _concatenated(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    return np.concatenate([first, second], axis=-1)


def _turn(T: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Return the rotation to a target orientation in base axes, as axis times sine of angle."""
    between = wanted[..., :3, :3] @ np.swapaxes(T[..., :3, :3], -1, -2)
    twice = between - np.swapaxes(between, -1, -2)
    return twice[..., (2, 0, 1), (1, 2, 0)] / 2


def _tilt(T: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Return the rotation of the tool's z axis to a direction, about the tool's x and y axes."""
    turn = np.cross(T[..., :3, 2], direction)
    return np.einsum("...ji,...j->...i", T[..., :3, :2], turn)


def _row(values: np.ndarray) -> np.ndarray:
    return values[..., None, :]


def _across(T: np.ndarray, J: np.ndarray) -> np.ndarray:
    """Return the Jacobian rows of the angular velocity about the x and y axes of the tool."""
    return np.swapaxes(T[..., :3, :2], -1, -2) @ J[..., 3:, :]


TASKS = {
    "ik": Task(
        lambda T: T,
        lambda T, t: np.maximum(_far(T, t[..., :3, 3]), turned(T[..., :3, :3], t[..., :3, :3])),
        lambda T, t: _concatenated(t[..., :3, 3] - T[..., :3, 3], _turn(T, t)),
        lambda _, J: J,
    ),
    "ik_position": Task(
        lambda T: T[..., :3, 3],
        _far,
        lambda T, p: p - T[..., :3, 3],
        lambda _, J: J[..., :3, :],
    ),
    "ik_orientation": Task(
        lambda T: T[..., :3, :3],
        lambda T, R: turned(T[..., :3, :3], R),
        _turn,
        lambda _, J: J[..., 3:, :],
    ),
    "ik_position_pitch": Task(
        lambda T: np.concatenate([T[..., :3, 3], _pitch(T)[..., None]], axis=-1),
        lambda T, x: np.maximum(_far(T, x[..., :3]), np.abs(_pitch(T) - x[..., 3])),
        lambda T, x: _concatenated(x[..., :3] - T[..., :3, 3], np.sin(x[..., 3:]) - T[..., 2:3, 2]),
        lambda T, J: np.concatenate([J[..., :3, :], _row(_pitch_rates(T, J))], axis=-2),
    ),
    "ik_position_direction": Task(
        lambda T: np.concatenate([T[..., :3, 3], T[..., :3, 2]], axis=-1),
        lambda T, x: np.maximum(
            _far(T, x[..., :3]), np.linalg.norm(T[..., :3, 2] - x[..., 3:], axis=-1)
        ),
        lambda T, x: _concatenated(x[..., :3] - T[..., :3, 3], _tilt(T, x[..., 3:])),
        lambda T, J: np.concatenate([J[..., :3, :], _across(T, J)], axis=-2),
    ),
    "ik_planar": Task(
        lambda T: np.stack([T[..., 0, 3], T[..., 1, 3], _heading(T)], axis=-1),
        lambda T, x: np.maximum(
            np.linalg.norm(T[..., :2, 3] - x[..., :2], axis=-1),
            np.abs(wrapped(_heading(T) - x[..., 2])),
        ),
        lambda T, x: _concatenated(
            x[..., :2] - T[..., :2, 3], wrapped(x[..., 2:] - _heading(T)[..., None])
        ),
        lambda _, J: J[..., (0, 1, 5), :],
    ),
}
