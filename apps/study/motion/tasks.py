"""Coordinate rates and accelerations along curves of tool poses or of task coordinates.

The coordinate rates are exact, without damping or limits. Close to a singularity, the coordinate
rates are large.

In the equations of the tool pitch P and tool angle A, x and z are the directions of the tool's
first and third axes. The tool twist is (v, omega), and its derivative is (a, alpha):

    pitch: sin P = z_z,  P' cos P = (omega x z)_z,  P'' cos P - P'^2 sin P = z''_z

    angle: A = atan2(x_y, x_x),  A' = omega_z,  A'' = alpha_z

    z'' = alpha x z + omega x (omega x z)

The equations of the tool angle A assume that the tool moves only in the x-y plane of the base.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from chasles import InputValueError, Robot
from chasles.fixed import Fixed, fixed_coordinates
from chasles.tolerances import RANK

from .redundancy import parametrized
from .task_curves import Task

FloatArray = NDArray[np.float64]

_STEP = 2e-3
"""Step of the fourth-order finite differences [rad or m]. Second derivatives divide rounding errors
by the squared step."""


def task_rates(
    robot: Robot, task: Task, q: FloatArray, by_s: FloatArray, by_ss: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return derivatives of the coordinates with respect to s from a curve in task coordinates.

    Joints that the inverse kinematics for a task sets to 0 do not move. The task determines the
    joint rates only if the number of moving joints equals the number of task coordinates.

    Args:
        robot: A robot with inverse kinematics for the task.
        task: The task.
        q: (m, n) coordinates on the curve [rad or m].
        by_s: (m, k) first derivatives of the task coordinates with respect to s.
        by_ss: (m, k) second derivatives of the task coordinates with respect to s.

    Returns:
        (m, n) first and second derivatives of q with respect to s.

    Raises:
        InputValueError: The number of moving joints differs from the number of task coordinates.
    """
    names = robot.free_coordinates.get(task, ())
    fixed = [robot.coordinate_names.index(name) for name in names]
    if robot.n - len(fixed) != by_s.shape[1]:
        raise InputValueError(
            f"{robot.name}: task {task}: the task does not determine the joint rates; got "
            f"{by_s.shape[1]} coordinates for {robot.n - len(fixed)} joints"
        )
    T, J = robot.fk_jacobian_mixed(q)
    J[..., fixed] = 0
    inverse = np.linalg.pinv(_jacobian(task, T, J))
    rate = (inverse @ by_s[..., None])[..., 0]
    # `own` is the task acceleration at zero joint accelerations.
    own = _acceleration(task, T, (J @ rate[..., None])[..., 0], _drift(robot, q, rate))
    return rate, (inverse @ (by_ss - own)[..., None])[..., 0]


def curve_rates(
    robot: Robot, q: FloatArray, V: FloatArray, A: FloatArray, fixed: Fixed | None
) -> tuple[FloatArray, FloatArray]:
    """Return minimum-norm derivatives of the coordinates along a curve of tool poses.

    Args:
        robot: The robot.
        q: (m, n) coordinates on the curve [rad or m].
        V: (m, 6) mixed twists per unit of s.
        A: (m, 6) derivatives of V with respect to s.
        fixed: Coordinates, or joints of the main chain, that do not move.

    Returns:
        (m, n) first and second derivatives of q with respect to s.
    """
    J = robot.fk_jacobian_mixed(q)[1]
    J[..., fixed_coordinates(robot, "joint_rates", fixed)] = 0
    inverse = np.linalg.pinv(J, rcond=RANK)
    rate = (inverse @ V[..., None])[..., 0]
    return rate, (inverse @ (A - _drift(robot, q, rate))[..., None])[..., 0]


def parameter_rates(
    robot: Robot,
    q: FloatArray,
    V: FloatArray,
    A: FloatArray,
    moves: Sequence[FloatArray] | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Return derivatives of the coordinates on a curve with known redundancy parameters.

    A redundancy parameter a(q), such as a swivel angle, has the known rate a'. Let n be the null
    vector of the Jacobian, and p the minimum-norm coordinate rate for the given twist. The rate c
    along n follows from D_n a c = a' - D_p a, where D_n and D_p are derivatives along n and p.

    Args:
        robot: The robot.
        q: (m, n) coordinates on the curve [rad or m].
        V: (m, 6) mixed twists per unit of s.
        A: (m, 6) derivatives of V with respect to s.
        moves: (m, p) first and second derivatives of the redundancy parameters with respect to s,
            or None for constant parameters.
    """
    indices = [item.index for item in robot.redundancy if item.index is not None]
    angles = [getattr(robot, item.name) for item in robot.redundancy if item.index is None]
    if not angles and moves is not None:
        return parametrized(robot, q, V, A, moves)
    if not angles:
        return curve_rates(robot, q, V, A, indices or None)
    (angle,), (by_s, by_ss) = angles, moves or (np.zeros((1, 1)), np.zeros((1, 1)))
    J = robot.fk_jacobian_mixed(q)[1]
    inverse, null = np.linalg.pinv(J, rcond=RANK), np.linalg.svd(J)[2][..., -1, :]
    slope = _along(angle, q, null)[0][:, None]
    part = (inverse @ V[..., None])[..., 0]
    rate = part + null * (by_s - _along(angle, q, part)[0][:, None]) / slope
    part = (inverse @ (A - _drift(robot, q, rate))[..., None])[..., 0]
    change = _along(angle, q, part)[0] + _along(angle, q, rate)[1]
    return rate, part + null * (by_ss - change[:, None]) / slope


def _along(
    angle: Callable[[FloatArray], FloatArray], q: FloatArray, rate: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the first and second directional derivatives (m,) of an angle along rates (m, n)."""
    size = np.linalg.norm(rate, axis=1)
    step = _STEP * rate / np.maximum(size, np.finfo(float).tiny)[:, None]
    moves = [angle(q + k * step) - angle(q) for k in (-2, -1, 1, 2)]
    b, a, c, d = (np.arctan2(np.sin(move), np.cos(move)) for move in moves)
    first = (8 * (c - a) - (d - b)) / (12 * _STEP)
    second = (16 * (a + c) - (b + d)) / (12 * _STEP**2)
    return first * size, second * size**2


def _drift(robot: Robot, q: FloatArray, rate: FloatArray) -> FloatArray:
    """Return the derivative (m, 6) of the mixed twist at constant coordinate rates."""
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
