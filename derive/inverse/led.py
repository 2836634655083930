"""How well a nominal arm leads to the true one: the share of sampled configurations it finds.

The true arm is put into configurations at random. The nominal arm's inverse of its pose is taken,
and Newton's iteration goes on from every branch on the true arm, as ``chasles_polish.h`` begins. A
structure that the axes miss by little leads back to the configuration, one that they miss by too
much does not.
"""

from collections.abc import Iterator

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ..model.robot import Robot
from ..model.tolerances import LED_BACK, LED_STEP
from ..terms.branches import patterns
from ..terms.casadi_graph import lower
from ..terms.symbolic_function import SymbolicFunction
from .structure.lines import Lines
from .structure.numeric_arm import NumericArm

FloatArray = NDArray[np.float64]
SAMPLES = 200
STEPS = 8


def share_led(robot: Robot, lines: Lines, nominal: SymbolicFunction) -> float:
    """The share of random configurations to which the nominal arm leads.

    Args:
        robot: The true arm.
        lines: Its axes.
        nominal: The task ``ik`` of the nominal arm; values of given joints follow the pose.

    Returns:
        From 0 to 1.
    """
    arm = NumericArm.of(robot, lines)
    q, T, branches = _sampled(arm, nominal)
    led = np.zeros(SAMPLES, dtype=bool)
    for start, _ in branches:
        found, left = _polished(arm, T, start, nominal.role.given)
        led |= (left < LED_BACK) & (_apart(found, q).max(-1) < LED_BACK)
    return float(led.mean())


def share_near(
    robot: Robot, lines: Lines, nominal: Robot, exact: Lines, given: tuple[int, ...]
) -> float:
    """The share of random configurations to which the nominal one beside them leads.

    Newton's iteration goes from a configuration to the nominal arm's for the same pose, and back on
    the true arm. It needs no inverse of the nominal arm, and is at most a little below
    :func:`share_led`: branches farther away rarely lead to a configuration.

    Args:
        robot: The true arm.
        lines: Its axes.
        nominal: The nominal arm.
        exact: Its axes.
        given: Indices of the joints that are given.
    """
    arm = NumericArm.of(robot, lines)
    q, T = _configurations(arm)
    start, _ = _polished(NumericArm.of(nominal, exact), T, q, given)
    found, left = _polished(arm, T, start, given)
    led = (left < LED_BACK) & (_apart(found, q).max(-1) < LED_BACK)
    return float(led.mean())


def separations(robot: Robot, lines: Lines, nominal: SymbolicFunction) -> tuple[float, ...]:
    """How far the solutions of a pose are apart in each joint that is solved for.

    Args:
        robot: The true arm, whose poses are taken.
        lines: Its axes.
        nominal: The task ``ik`` of the nominal arm, whose solutions are compared.

    Returns:
        The median over random poses of the least difference (radian); 0 where no pose has two
        solutions.
    """
    _, _, branches = _sampled(NumericArm.of(robot, lines), nominal)
    q = np.stack([start for start, _ in branches], 1)
    is_there = np.stack([residual < LED_BACK for _, residual in branches], 1)
    apart = _apart(q[:, :, None], q[:, None])
    pairs = is_there[:, :, None] & is_there[:, None] & ~np.eye(len(branches), dtype=bool)
    least = np.where(pairs[..., None], apart, np.inf).min((1, 2))
    least = least[pairs.any((1, 2))]
    found = np.median(least, axis=0) if len(least) else np.zeros(q.shape[-1])
    return tuple(float(x) for k, x in enumerate(found) if k not in nominal.role.given)


Branch = tuple[FloatArray, FloatArray]
"""The coordinates (N, n) of a branch, and the residual (N,)."""


def _sampled(
    arm: NumericArm, nominal: SymbolicFunction
) -> tuple[FloatArray, FloatArray, list[Branch]]:
    """Random configurations (N, n), their poses, and every branch of the nominal arm there."""
    q, T = _configurations(arm)
    given = q[:, list(nominal.role.given)]
    (kernel,) = lower([nominal], "nominal")
    return q, T, list(_branches(kernel, nominal, T, given))


def _configurations(arm: NumericArm) -> tuple[FloatArray, FloatArray]:
    """Random configurations (N, n), and their poses."""
    q = np.random.default_rng(0).uniform(-np.pi, np.pi, (SAMPLES, len(arm.turns)))
    return q, arm.pose_jacobian(q)[0]


def _branches(
    kernel: ca.Function, nominal: SymbolicFunction, T: FloatArray, given: FloatArray
) -> Iterator[Branch]:
    inputs = [T.reshape(len(T), 16).T, *(values[None] for values in given.T)]
    for signs in patterns(nominal) if nominal.signs else [None]:
        choice = [] if signs is None else [np.repeat(np.array(signs)[:, None], len(T), 1)]
        q, residual = kernel(*inputs, *choice)[:2]
        yield np.array(q).T, np.array(residual)[0]


def _apart(q: FloatArray, other: FloatArray) -> FloatArray:
    """Differences of joints, the shorter way round."""
    return np.asarray(np.abs(np.remainder(q - other + np.pi, 2 * np.pi) - np.pi))


def _polished(
    arm: NumericArm, T: FloatArray, q: FloatArray, given: tuple[int, ...]
) -> tuple[FloatArray, FloatArray]:
    """Newton's steps (N, n), and what they leave (N,): radian, parts of the arm's length."""
    weights = np.array([1 / arm.length] * 3 + [1.0] * 3)
    q = np.nan_to_num(q)
    for _ in range(STEPS):
        here, J = arm.pose_jacobian(q)
        J[..., list(given)] = 0.0
        error = twist_between(here, T) * weights
        inverse = np.linalg.pinv(J * weights[:, None], rcond=LED_BACK)
        step = np.einsum("Nij,Nj->Ni", inverse, error)
        q = q + step * LED_STEP / np.maximum(np.abs(step).max(-1, keepdims=True), LED_STEP)
    here, _ = arm.pose_jacobian(q)
    return q, np.abs(twist_between(here, T) * weights).max(-1)


def twist_between(here: FloatArray, there: FloatArray) -> FloatArray:
    """Twists (N, 6) from poses to others; the angular part is the axis times the sine."""
    turn = there[:, :3, :3] @ np.swapaxes(here[:, :3, :3], 1, 2)
    skew = (turn - np.swapaxes(turn, 1, 2)) / 2
    angular = np.stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]], -1)
    return np.hstack([there[:, :3, 3] - here[:, :3, 3], angular])
