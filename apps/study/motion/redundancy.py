"""Redundancy "minimum_norm": more joints move than the curve has conditions.

From one posture, the start, each pose of the curve is solved for itself by Newton's iteration in
the joints theta of the main chain:

    theta <- theta + J^+(theta) e(theta),   e = (p - p(theta); log(R R(theta)^T))

Among the steps that meet the linear conditions, the pseudo-inverse J^+ takes the least in joints,
whatever moves them: the lengths of cylinders do not count. So the posture at a pose depends on the
start and the pose alone, not on the way between them, nor on the samples: a closed curve leads back
to the same posture, unlike the integral of rates of minimum norm. It is near the start, but not the
nearest posture: from the second step on, the norm is measured from where the step before ended.

Source:
    D. E. Whitney, Resolved motion rate control of manipulators and human prostheses, 1969, for
    rates of minimum norm.
"""

from __future__ import annotations

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
"""Steps after which the iteration is given up; it takes 5 to 8 where it converges."""
_OFFSETS = np.array([[0, 1, 2, 3, 4], [-2, -1, 0, 1, 2], [-4, -3, -2, -1, 0]], dtype=np.float64)
"""Nodes of the differences at the start of a curve, inside it and at its end."""


class OnCurve(NamedTuple):
    """A robot on a curve, without time.

    Attributes:
        q: (m, n) coordinates [rad or m].
        by_s: (m, n) their first derivative by s.
        by_ss: (m, n) their second derivative by s.
    """

    q: FloatArray
    by_s: FloatArray
    by_ss: FloatArray


def minimum_norm(
    robot: Robot, curve: PoseCurve, s: FloatArray, start: FloatArray, fixed: Fixed | None = None
) -> OnCurve:
    """Coordinates on a curve of the tool by steps of minimum norm from one posture.

    The tool's motion is exact: derivatives by s meet the curve's twist and its derivative to
    rounding. Their part without motion of the tool follows from differences of fourth order.
    These lose digits near singularities, where joints turn far within a hundredth of the curve.

    Args:
        robot: A robot whose chain has as many joints as it has coordinates.
        curve: The curve of the tool.
        s: (m,) lengths on it.
        start: (n,) coordinates of the posture from which each pose is solved [rad or m].
        fixed: Coordinates, or joints of the main chain, that do not move.

    Raises:
        InputValueError: The joints of the chain do not move independently.
        OutOfReachError: The iteration does not reach a pose, or joints jump along the curve.
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


def _moving(robot: Robot, fixed: Fixed | None) -> BoolArray:
    """(n,) the joints of the main chain that move."""
    if len(robot.chain_joints) != robot.n:
        raise InputValueError(
            f"{robot.name}: minimum_norm needs a chain whose joints move independently, it has "
            f"{len(robot.chain_joints)} joints for {robot.n} coordinates"
        )
    locked = fixed_coordinates(robot, "minimum_norm", fixed)
    return np.asarray(follows(robot)[:, ~locked].any(1))


def _solved(
    robot: Robot, curve: PoseCurve, s: FloatArray, theta_0: FloatArray, moving: BoolArray
) -> FloatArray:
    """(m, n) joints at lengths (m,), each by the iteration from theta_0."""
    T = curve.at(s).T
    theta = np.tile(theta_0, (len(s), 1))
    met = False
    for _ in range(_STEPS):
        _, reached, J = _kinematics(robot, theta)
        error = np.hstack([T[:, :3, 3] - reached[:, :3, 3], _turn(T, reached)])
        theta[:, moving] += _pinv(J[..., moving], error)
        if met:
            return theta
        # A last step follows, which squares the residual.
        met = bool((np.abs(error) < ON_CURVE * robot.unit_length).all())
        if not np.isfinite(theta).all():
            break
    missed = int(np.argmax(np.nan_to_num(np.abs(error).max(-1), nan=np.inf)))
    raise OutOfReachError(
        f"{robot.name}: at {s[missed] / curve.length:.1%} of the curve steps of minimum norm from "
        f"the start do not reach the tool's pose"
    )


def _on_curve(
    robot: Robot,
    curve: PoseCurve,
    s: FloatArray,
    joints: tuple[FloatArray, FloatArray, FloatArray],
    moving: BoolArray,
) -> OnCurve:
    """Coordinates, from joints and their differences that the curve's twist corrects."""
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
    """First and second derivatives of the coordinates from those of the joints."""
    if not robot.loops:
        return by_s, by_ss
    return robot.actuator_rates(theta, by_s), robot.actuator_accelerations(theta, by_s, by_ss)


def _kinematics(robot: Robot, theta: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Coordinates (m, n), poses (m, 4, 4) and mixed Jacobians by the joints (m, 6, n)."""
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
            f"{robot.name}: at {s[k] / curve.length:.1%} of the curve the steps of minimum norm "
            f"change their end: a joint jumps by {jumps[k]:.3g}"
        )


def _weights() -> tuple[FloatArray, FloatArray, FloatArray]:
    """(3, 5) weights of the nodes for the value, the first and the second derivative."""
    powers = _OFFSETS[..., None] ** np.arange(_OFFSETS.shape[1])
    inverse = np.asarray(np.linalg.inv(powers), dtype=np.float64)
    value = (_OFFSETS == 0).astype(np.float64)
    return value, inverse[:, 1], 2 * inverse[:, 2]


_WEIGHTS = _weights()
