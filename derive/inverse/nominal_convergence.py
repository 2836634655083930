"""Convergence of Newton's method from solutions of a nominal arm to the calibrated arm.

The calibrated arm is placed in random configurations. The inverse kinematics of the nominal arm is
solved for the resulting tool poses. On every solution branch, Newton's method refines the nominal
solution on the calibrated arm, as in ``chasles_polish.h``. If the nominal arm is close enough to
the calibrated arm, one branch converges to the configuration from which the pose was computed.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ..model.robot import SerialRobot
from ..model.tolerances import MAX_REFINING_STEP, RECOVERED
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
    """Random configurations of a calibrated arm, with nominal solutions for their tool poses.

    Attributes:
        arm: Numeric model of the calibrated arm.
        given: Indices of the fixed joints in the chain.
        q: Configurations (N, n).
        T: Tool poses (N, 4, 4) of the configurations.
        branches: Joint coordinates (N, n) and residual (N,) of each solution branch of the nominal
            arm.
    """

    arm: NumericArm
    given: tuple[int, ...]
    q: FloatArray
    T: FloatArray
    branches: tuple[tuple[FloatArray, FloatArray], ...]

    @classmethod
    def of(cls, robot: SerialRobot, lines: Lines, nominal: SymbolicFunction) -> "Sampled":
        """Sample poses of the calibrated arm, and solve ``ik`` of the nominal arm for them.

        The values of the fixed joints are inputs of ``ik`` and come from the sampled
        configurations.
        """
        arm, given = NumericArm.of(robot, lines), nominal.role.fixed
        q, T = _configurations(arm)
        (kernel,) = lower([nominal], "nominal")
        branches = _branches(kernel, nominal, T, q[:, list(given)])
        return cls(arm, given, q, T, tuple(branches))

    @cached_property
    def refined(self) -> tuple[tuple[FloatArray, FloatArray], ...]:
        """Joint coordinates (N, n) and pose errors (N,) after Newton's method, for each branch."""
        return tuple(_polished(self.arm, self.T, start, self.given) for start, _ in self.branches)

    @property
    def share_converged(self) -> float:
        """Fraction (0 to 1) of the sampled configurations that Newton's method recovers."""
        converged = np.zeros(len(self.q), dtype=bool)
        for found, left in self.refined:
            converged |= (left < RECOVERED) & (_apart(found, self.q).max(-1) < RECOVERED)
        return float(converged.mean())

    @property
    def move(self) -> float:
        """Median joint rotation (radian) from a nominal solution to its refined solution.

        The median is taken over the largest joint rotation of each converged solution, and is 0 if
        Newton's method never converges.
        """
        turns = np.array(self.arm.turns)
        moves = [np.zeros(0)]
        for (start, residual), (found, left) in zip(self.branches, self.refined, strict=True):
            is_refined = (residual < RECOVERED) & (left < RECOVERED)
            moves.append(_apart(found, start)[is_refined][:, turns].max(-1, initial=0.0))
        moved = np.concatenate(moves)
        return float(np.median(moved)) if len(moved) else 0.0

    @property
    def share_nearby(self) -> float:
        """Fraction (0 to 1) of the sampled configurations that are near a nominal solution."""
        apart = [_apart(start, self.q).max(-1) for start, _ in self.branches]
        return float((np.min(apart, axis=0) < MAX_REFINING_STEP).mean())

    @property
    def separations(self) -> tuple[float, ...]:
        """Typical difference between two nominal solutions of a pose, for each free joint.

        Each entry is the median, over all poses with several solutions, of the smallest difference
        (radian) between two solutions.
        """
        q = np.stack([start for start, _ in self.branches], 1)
        is_there = np.stack([residual < RECOVERED for _, residual in self.branches], 1)
        apart = _apart(q[:, :, None], q[:, None])
        pairs = is_there[:, :, None] & is_there[:, None] & ~np.eye(len(self.branches), dtype=bool)
        least = np.where(pairs[..., None], apart, np.inf).min((1, 2))
        least = least[pairs.any((1, 2))]
        found = np.median(least, axis=0) if len(least) else np.zeros(q.shape[-1])
        return tuple(float(x) for k, x in enumerate(found) if k not in self.given)


def share_near(
    robot: SerialRobot, lines: Lines, nominal: SerialRobot, exact: Lines, given: tuple[int, ...]
) -> float:
    """Return the fraction of random configurations that Newton's method recovers.

    Newton's method solves the pose of each random configuration on the nominal arm and then on the
    calibrated arm. This test needs no inverse kinematics function of the nominal arm.

    Args:
        robot: The calibrated arm.
        lines: Axes of the calibrated arm.
        nominal: The nominal arm.
        exact: Axes of the nominal arm.
        given: Indices of the fixed joints.
    """
    arm = NumericArm.of(robot, lines)
    q, T = _configurations(arm)
    start, _ = _polished(NumericArm.of(nominal, exact), T, q, given)
    found, left = _polished(arm, T, start, given)
    converged = (left < RECOVERED) & (_apart(found, q).max(-1) < RECOVERED)
    return float(converged.mean())


def _configurations(arm: NumericArm) -> tuple[FloatArray, FloatArray]:
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
    return np.asarray(np.abs(np.remainder(q - other + np.pi, 2 * np.pi) - np.pi))


def _polished(
    arm: NumericArm, T: FloatArray, q: FloatArray, given: tuple[int, ...]
) -> tuple[FloatArray, FloatArray]:
    """Return the configurations (N, n) and pose errors (N,) after Newton's method.

    Each pose error is the largest component of a twist, in radian or as a distance divided by the
    arm length.
    """
    weights = np.array([1 / arm.length] * 3 + [1.0] * 3)
    q = np.nan_to_num(q)
    for _ in range(STEPS):
        here, J = arm.pose_jacobian(q)
        J[..., list(given)] = 0.0
        error = twist_between(here, T) * weights
        inverse = np.linalg.pinv(J * weights[:, None], rcond=RECOVERED)
        step = np.einsum("Nij,Nj->Ni", inverse, error)
        q = q + step * MAX_REFINING_STEP / np.maximum(
            np.abs(step).max(-1, keepdims=True), MAX_REFINING_STEP
        )
    here, _ = arm.pose_jacobian(q)
    return q, np.abs(twist_between(here, T) * weights).max(-1)


def twist_between(here: FloatArray, there: FloatArray) -> FloatArray:
    """Return the twists (N, 6) between pairs of poses.

    The angular part of each twist is the rotation axis times the sine of the rotation angle.
    """
    turn = there[:, :3, :3] @ np.swapaxes(here[:, :3, :3], 1, 2)
    skew = (turn - np.swapaxes(turn, 1, 2)) / 2
    angular = np.stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]], -1)
    return np.hstack([there[:, :3, 3] - here[:, :3, 3], angular])
