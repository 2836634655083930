"""Motions with the option redundancy="minimum_norm", for robots with redundant joints.

Newton's method solves the inverse kinematics of each pose independently, from the same start
configuration of the main-chain joints theta:

    theta <- theta + J^+(theta) e(theta),   e = (p - p(theta); log(R R(theta)^T))

The error e compares the target position p and rotation R with the tool position and rotation at
theta. The pseudo-inverse J^+ of the Jacobian gives the joint step with the smallest norm. The norm
of a step includes the main-chain joints, but not the cylinder lengths. The configuration at a pose
depends only on the start configuration and the pose, so a closed curve returns to the same
configuration. The resulting configuration is not always the one nearest to the start configuration.

Source:
    D. E. Whitney, Resolved motion rate control of manipulators and human prostheses, 1969, for
    minimum-norm rates.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chasles import InputValueError, OutOfReachError, Robot, so3
from chasles.fixed import Fixed, fixed_coordinates, follows
from chasles.tolerances import JUMP, RANK

from ..tolerances import NODES_APART, ON_CURVE
from .curves import PoseCurve

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_STEPS = 30
"""Maximum number of Newton steps of the inverse kinematics."""
_OFFSETS = np.array([[0, 1, 2, 3, 4], [-2, -1, 0, 1, 2], [-4, -3, -2, -1, 0]], dtype=np.float64)
"""Offsets of the five finite-difference nodes from the evaluated point, in units of the node
spacing. The three rows of offsets apply at the start, inside and at the end of a curve."""


class OnCurve(NamedTuple):
    """Configurations along a tool curve and their derivatives with respect to the curve length s.

    Attributes:
        q: (m, n) coordinates [rad or m].
        by_s: (m, n) first derivatives of q with respect to s.
        by_ss: (m, n) second derivatives of q with respect to s.
    """

    q: FloatArray
    by_s: FloatArray
    by_ss: FloatArray


def minimum_norm(
    robot: Robot, curve: PoseCurve, s: FloatArray, start: FloatArray, fixed: Fixed | None = None
) -> OnCurve:
    """Return the coordinates, and their derivatives, with which the tool follows a curve.

    Minimum-norm steps from `start` solve the inverse kinematics of each pose.

    The derivatives of the coordinates with respect to the curve length s match the twist of the
    curve up to rounding errors. The null-space components of the derivatives are computed by finite
    differences of fourth order. Near singularities, the finite differences are inaccurate.

    Args:
        robot: A robot whose main chain has as many joints as the robot has coordinates.
        curve: The curve of tool poses.
        s: (m,) lengths on the curve.
        start: (n,) start configuration of the Newton iteration for every pose [rad or m].
        fixed: Coordinates, or joints of the main chain, that do not move.

    Raises:
        InputValueError: The joints of the main chain do not move independently.
        OutOfReachError: The Newton iteration does not reach a tool pose, or a joint jumps along the
            curve.
    """
    moving = _moving(robot, fixed)
    theta_0 = robot.chain(start) if robot.loops else np.asarray(start, dtype=np.float64)
    step = NODES_APART * curve.length
    side = np.where(s < 2 * step, 0, np.where(s > curve.length - 2 * step, 2, 1))
    nodes = s[:, None] + step * _OFFSETS[side]
    theta = _solved(robot, curve, nodes.ravel(), theta_0, moving).reshape(*nodes.shape, -1)
    _require_no_jump(robot, curve, s, theta)
    values, by_s, by_ss = (
        np.einsum("mk,mkj->mj", weights[side], theta) / step**order
        for order, weights in enumerate(_WEIGHTS)
    )
    return _on_curve(robot, curve, s, (values, by_s, by_ss), moving)


def parametrized(
    robot: Robot, q: FloatArray, V: FloatArray, A: FloatArray, moves: Sequence[FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """Return derivatives of q on a tool curve, for given derivatives of the redundancy parameters.

    Args:
        robot: A robot whose redundancy parameters are joints of the main chain.
        q: (m, n) coordinates on the curve [rad or m].
        V: (m, 6) mixed twists of the tool per unit of the curve length s.
        A: (m, 6) derivatives of the twists V with respect to s.
        moves: (m, p) first and second derivatives of the redundancy parameters with respect to s.

    Returns:
        (m, n) first and second derivatives of q with respect to s.
    """
    theta = robot.chain(q) if robot.loops else q
    given = [robot.joint_names.index(item.name) for item in robot.redundancy]
    free = [k for k in range(theta.shape[1]) if k not in given]
    J = _kinematics(robot, theta)[2]
    by_s, by_ss = np.zeros_like(theta), np.zeros_like(theta)
    by_s[:, given], by_ss[:, given] = moves
    by_s[:, free] = _pinv(J[..., free], V - _times(J, by_s))
    own = robot.acceleration_mixed(q, *_of_coordinates(robot, theta, by_s, by_ss))
    by_ss[:, free] = _pinv(J[..., free], A - own)
    return _of_coordinates(robot, theta, by_s, by_ss)


def _moving(robot: Robot, fixed: Fixed | None) -> BoolArray:
    """Return a mask (n,) of the moving joints of the main chain."""
    if len(robot.chain_joints) != robot.n:
        raise InputValueError(
            f"{robot.name}: minimum_norm requires independent joints, but the main chain has "
            f"{len(robot.chain_joints)} joints for {robot.n} coordinates"
        )
    locked = fixed_coordinates(robot, "minimum_norm", fixed)
    return np.asarray(follows(robot)[:, ~locked].any(1))


def _solved(
    robot: Robot, curve: PoseCurve, s: FloatArray, theta_0: FloatArray, moving: BoolArray
) -> FloatArray:
    """Return the joint positions (m, n) of the main chain at curve lengths s (m,).

    At each curve length, minimum-norm Newton steps start from the joint positions `theta_0`.
    """
    T = curve.at(s).T
    theta = np.tile(theta_0, (len(s), 1))
    met = False
    for _ in range(_STEPS):
        _, reached, J = _kinematics(robot, theta)
        error = np.hstack([T[:, :3, 3] - reached[:, :3, 3], _turn(T, reached)])
        theta[:, moving] += _pinv(J[..., moving], error)
        if met:
            return theta
        # After convergence, one more Newton step reduces the residual quadratically.
        met = bool((np.abs(error) < ON_CURVE * robot.unit_length).all())
        if not np.isfinite(theta).all():
            break
    missed = int(np.argmax(np.nan_to_num(np.abs(error).max(-1), nan=np.inf)))
    raise OutOfReachError(
        f"{robot.name}: minimum-norm steps from the start do not reach the tool pose at "
        f"{s[missed] / curve.length:.1%} of the curve"
    )


def _on_curve(
    robot: Robot,
    curve: PoseCurve,
    s: FloatArray,
    joints: tuple[FloatArray, FloatArray, FloatArray],
    moving: BoolArray,
) -> OnCurve:
    """Convert joint positions and their finite differences to coordinates and their derivatives."""
    theta, by_s, by_ss = joints
    _, V, A = curve.at(s)
    q, _, J = _kinematics(robot, theta)
    by_s[:, moving] += _pinv(J[..., moving], V - _times(J, by_s))
    own = robot.acceleration_mixed(q, *_of_coordinates(robot, theta, by_s, by_ss))
    by_ss[:, moving] += _pinv(J[..., moving], A - own)
    return OnCurve(q, *_of_coordinates(robot, theta, by_s, by_ss))


def _of_coordinates(
    robot: Robot, theta: FloatArray, by_s: FloatArray, by_ss: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Convert first and second derivatives of the joints to derivatives of the coordinates."""
    if not robot.loops:
        return by_s, by_ss
    return robot.actuator_rates(theta, by_s), robot.actuator_accelerations(theta, by_s, by_ss)


def _kinematics(robot: Robot, theta: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return (coordinates (m, n), poses (m, 4, 4), joint-space mixed Jacobians (m, 6, n))."""
    if not robot.loops:
        return theta, *robot.fk_jacobian_mixed(theta)
    q = robot.actuators(theta)
    T, J = robot.fk_jacobian_mixed(q)
    return q, T, J @ robot.actuators_D_chain(theta)


def _turn(T: FloatArray, reached: FloatArray) -> FloatArray:
    return np.asarray(so3.log(T[:, :3, :3] @ np.swapaxes(reached[:, :3, :3], -1, -2)))


def _pinv(J: FloatArray, twist: FloatArray) -> FloatArray:
    if not np.isfinite(J).all():
        return np.full(J[:, 0].shape, np.nan)
    return _times(np.asarray(np.linalg.pinv(J, rcond=RANK), dtype=np.float64), twist)


def _times(matrices: FloatArray, vectors: FloatArray) -> FloatArray:
    return np.asarray((matrices @ vectors[..., None])[..., 0])


def _require_no_jump(robot: Robot, curve: PoseCurve, s: FloatArray, theta: FloatArray) -> None:
    jumps = np.abs(np.diff(theta, axis=1)).max(axis=(1, 2))
    if len(jumps) and jumps.max() > JUMP:
        k = int(np.argmax(jumps))
        raise OutOfReachError(
            f"{robot.name}: minimum-norm steps lead to another solution: a joint jumps by "
            f"{jumps[k]:.3g} at {s[k] / curve.length:.1%} of the curve"
        )


def _weights() -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the finite-difference weights for a value, its first and its second derivative.

    The three rows of each array (3, 5) apply at the start, inside and at the end of a curve. Each
    column belongs to a node.
    """
    powers = _OFFSETS[..., None] ** np.arange(_OFFSETS.shape[1])
    inverse = np.asarray(np.linalg.inv(powers), dtype=np.float64)
    value = (_OFFSETS == 0).astype(np.float64)
    return value, inverse[:, 1], 2 * inverse[:, 2]


_WEIGHTS = _weights()
