"""How well a nominal arm leads to the true one: the share of sampled configurations it finds.

The true arm is put into configurations at random. The nominal arm's inverse of its pose is taken,
and Newton's iteration goes on from every branch on the true arm, as ``chasles_polish.h`` begins. A
structure that the axes miss by little leads back to the configuration, one that they miss by too
much does not.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ..model.robot import SerialRobot
from ..model.tolerances import LED_BACK, LED_STEP
from ..terms.branches import patterns
from ..terms.casadi_graph import lower
from ..terms.symbolic_function import SymbolicFunction
from .structure.lines import Lines
from .structure.numeric_arm import NumericArm

FloatArray = NDArray[np.float64]
SAMPLES = 200
STEPS = 8


@dataclass(frozen=True)
class Sampled:
    """The true arm in random configurations, and the nominal arm's inverse of its poses.

    Attributes:
        arm: The true arm, in numbers.
        given: Indices of the joints that are given.
        q: The configurations (N, n).
        T: Their poses (N, 4, 4).
        branches: Each branch of the nominal inverse: coordinates (N, n) and residual (N,).
    """

    arm: NumericArm
    given: tuple[int, ...]
    q: FloatArray
    T: FloatArray
    branches: tuple[tuple[FloatArray, FloatArray], ...]

    @classmethod
    def of(cls, robot: SerialRobot, lines: Lines, nominal: SymbolicFunction) -> "Sampled":
        """Takes the poses of a robot of these axes to the task ``ik`` of a nominal arm.

        The values of given joints follow the poses.
        """
        arm, given = NumericArm.of(robot, lines), nominal.role.given
        q, T = _configurations(arm)
        (kernel,) = lower([nominal], "nominal")
        branches = _branches(kernel, nominal, T, q[:, list(given)])
        return cls(arm, given, q, T, tuple(branches))

    @property
    def share_led(self) -> float:
        """The share of configurations to which the nominal arm leads, from 0 to 1."""
        led = np.zeros(len(self.q), dtype=bool)
        for start, _ in self.branches:
            found, left = _polished(self.arm, self.T, start, self.given)
            led |= (left < LED_BACK) & (_apart(found, self.q).max(-1) < LED_BACK)
        return float(led.mean())

    @property
    def move(self) -> float:
        """Median of the largest joint move (radian) from a nominal solution to its true one.

        0 if no nominal solution leads to a true one.
        """
        turns = np.array(self.arm.turns)
        moves = [np.zeros(0)]
        for start, residual in self.branches:
            found, left = _polished(self.arm, self.T, start, self.given)
            is_led = (residual < LED_BACK) & (left < LED_BACK)
            moves.append(_apart(found, start)[is_led][:, turns].max(-1, initial=0.0))
        moved = np.concatenate(moves)
        return float(np.median(moved)) if len(moved) else 0.0

    @property
    def share_beside(self) -> float:
        """The share of configurations beside which some branch starts, from 0 to 1."""
        apart = [_apart(start, self.q).max(-1) for start, _ in self.branches]
        return float((np.min(apart, axis=0) < LED_STEP).mean())

    @property
    def separations(self) -> tuple[float, ...]:
        """How far the solutions of a pose are apart in each joint that is solved for.

        The median over the poses of the least difference (radian); 0 where no pose has two
        solutions.
        """
        q = np.stack([start for start, _ in self.branches], 1)
        is_there = np.stack([residual < LED_BACK for _, residual in self.branches], 1)
        apart = _apart(q[:, :, None], q[:, None])
        pairs = is_there[:, :, None] & is_there[:, None] & ~np.eye(len(self.branches), dtype=bool)
        least = np.where(pairs[..., None], apart, np.inf).min((1, 2))
        least = least[pairs.any((1, 2))]
        found = np.median(least, axis=0) if len(least) else np.zeros(q.shape[-1])
        return tuple(float(x) for k, x in enumerate(found) if k not in self.given)


def share_near(
    robot: SerialRobot, lines: Lines, nominal: SerialRobot, exact: Lines, given: tuple[int, ...]
) -> float:
    """The share of random configurations to which the nominal one beside them leads.

    Newton's iteration goes from a configuration to the nominal arm's for the same pose, and back on
    the true arm. It needs no inverse of the nominal arm. Where that has a branch beside most
    configurations, it is at most a little below
    :attr:`Sampled.share_led`: branches farther away rarely lead to a configuration.

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


def _configurations(arm: NumericArm) -> tuple[FloatArray, FloatArray]:
    """Random configurations (N, n), and their poses."""
    q = np.random.default_rng(0).uniform(-np.pi, np.pi, (SAMPLES, len(arm.turns)))
    return q, arm.pose_jacobian(q)[0]


def _branches(
    kernel: ca.Function, nominal: SymbolicFunction, T: FloatArray, given: FloatArray
) -> Iterator[tuple[FloatArray, FloatArray]]:
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
