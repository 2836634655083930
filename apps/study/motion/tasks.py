"""Rates and accelerations on a curve of the tool, or in the coordinates of a task.

Neither damping nor limits change them: close to a singularity they grow as the curve demands.

With the position p and the directions x and z of the tool's first and third axes, their twist
(v, omega) and its derivative (a, alpha):

    pitch: sin P = z_z,      P' cos P = (omega x z)_z,    P'' cos P - P'^2 sin P = z''_z
    angle: A = atan2(x_y, x_x), A' = omega_z, A'' = alpha_z   (the tool's plane stays the base's)
    z'' = alpha x z + omega x (omega x z)
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chasles import InputValueError, Robot
from chasles.fixed import Fixed, fixed_coordinates
from chasles.tolerances import RANK

from .curves import Task

FloatArray = NDArray[np.float64]


def task_rates(
    robot: Robot, task: Task, q: FloatArray, by_s: FloatArray, by_ss: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Derivatives of the coordinates by s on a curve in task coordinates.

    Joints that the task's inverse holds do not move. The others must be as many as the task has
    coordinates: the rates of further ones would not follow from the task.

    Args:
        robot: A robot with the inverse of the task.
        task: The task.
        q: (m, n) coordinates on the curve [rad or m].
        by_s: (m, k) first derivative of the task coordinates by s.
        by_ss: (m, k) second derivative.

    Returns:
        (m, n) first and second derivative of q by s.

    Raises:
        InputValueError: More joints move than the task has coordinates.
    """
    names = robot.free_coordinates.get(task, ())
    held = [robot.coordinate_names.index(name) for name in names]
    if robot.n - len(held) != by_s.shape[1]:
        raise InputValueError(
            f"{robot.name}: {robot.n - len(held)} joints move for the {by_s.shape[1]} coordinates "
            f"of task {task}, which leaves their rates open"
        )
    T, J = robot.fk_jacobian_mixed(q)
    J[..., held] = 0
    inverse = np.linalg.pinv(_jacobian(task, T, J))
    rate = (inverse @ by_s[..., None])[..., 0]
    # The task's acceleration while the joints have no acceleration of their own.
    own = _acceleration(task, T, (J @ rate[..., None])[..., 0], _drift(robot, q, rate))
    return rate, (inverse @ (by_ss - own)[..., None])[..., 0]


def curve_rates(
    robot: Robot, q: FloatArray, V: FloatArray, A: FloatArray, lock: Fixed | None
) -> tuple[FloatArray, FloatArray]:
    """Derivatives of the coordinates by s on a curve of the tool; the least ones if several fit.

    Args:
        robot: The robot.
        q: (m, n) coordinates on the curve [rad or m].
        V: (m, 6) mixed twist by s.
        A: (m, 6) its derivative by s.
        lock: Coordinates, or joints of the main chain, that do not move.

    Returns:
        (m, n) first and second derivative of q by s.
    """
    J = robot.fk_jacobian_mixed(q)[1]
    J[..., fixed_coordinates(robot, "joint_rates", lock)] = 0
    inverse = np.linalg.pinv(J, rcond=RANK)
    rate = (inverse @ V[..., None])[..., 0]
    return rate, (inverse @ (A - _drift(robot, q, rate))[..., None])[..., 0]


def _drift(robot: Robot, q: FloatArray, rate: FloatArray) -> FloatArray:
    """The derivative of the mixed twist at constant rates."""
    return np.asarray(robot.acceleration_mixed(q, rate, np.zeros(q.shape)))


def _jacobian(task: Task, T: FloatArray, J: FloatArray) -> FloatArray:
    v, omega = J[..., :3, :], J[..., 3:, :]
    if task == "position":
        return v
    if task == "planar":
        return np.concatenate([v[..., :2, :], omega[..., 2:, :]], axis=-2)
    z = T[..., :3, 2]
    rise = omega[..., 0, :] * z[..., 1:2] - omega[..., 1, :] * z[..., 0:1]
    return np.concatenate([v, (rise / _cosine(z)[..., None])[..., None, :]], axis=-2)


def _acceleration(task: Task, T: FloatArray, V: FloatArray, A: FloatArray) -> FloatArray:
    a, omega, alpha = A[..., :3], V[..., 3:], A[..., 3:]
    if task == "position":
        return a
    if task == "planar":
        return np.concatenate([a[..., :2], alpha[..., 2:]], axis=-1)
    z = T[..., :3, 2]
    turn = np.cross(omega, z)
    cosine = _cosine(z)
    pitch_rate = turn[..., 2] / cosine
    rise = (np.cross(alpha, z) + np.cross(omega, turn))[..., 2]
    return np.concatenate([a, ((rise + pitch_rate**2 * z[..., 2]) / cosine)[..., None]], axis=-1)


def _cosine(z: FloatArray) -> FloatArray:
    return np.asarray(np.hypot(z[..., 0], z[..., 1]))
