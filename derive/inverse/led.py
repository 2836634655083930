"""How well a nominal arm leads to the true one: the share of sampled configurations it finds.

The true arm is put into configurations at random. The nominal arm's inverse of its pose is taken,
and Newton's iteration goes on from every branch on the true arm, as ``chasles_polish.h`` begins. A
structure that the axes miss by little leads back to the configuration, one that they miss by too
much does not.
"""

from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ..model.robot import Robot
from ..model.tolerances import LED_BACK, LED_STEP
from ..terms.branches import patterns
from ..terms.casadi_graph import lower
from ..terms.symbolic_function import SymbolicFunction
from .structure.lines import Lines, home_of, numbers

FloatArray = NDArray[np.float64]
SAMPLES = 200
STEPS = 8


@dataclass(frozen=True)
class _Arm:
    """An arm in numbers.

    Attributes:
        directions: (n, 3) of the axes in the home pose.
        points: (n, 3) on the axes.
        turns: (n,) whether a joint is revolute.
        senses: (n,) 1 or -1, the sense of a coordinate.
        home: (4, 4) the tool's pose at zero.
        length: The arm's length (metre).
    """

    directions: FloatArray
    points: FloatArray
    turns: NDArray[np.bool_]
    senses: FloatArray
    home: FloatArray
    length: float

    @classmethod
    def of(cls, robot: Robot, lines: Lines) -> "_Arm":
        """The arm of a description."""
        home = numbers(lines.terms, home_of(robot, lines.terms)).reshape(4, 4)
        return cls(
            np.array([axis.direction for axis in lines.axes]),
            np.array([axis.origin for axis in lines.axes]),
            np.array([axis.turns for axis in lines.axes]),
            np.array([float(joint.direction) for joint in robot.moving]),
            home,
            lines.length or 1.0,
        )

    def pose_jacobian(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Poses (N, 4, 4) and Jacobians (N, 6, n) at the tip in base axes, at q (N, n)."""
        R, p = np.broadcast_to(np.eye(3), (len(q), 3, 3)), np.zeros((len(q), 3))
        axes = []
        for h, point, turns, sense, value in zip(
            self.directions, self.points, self.turns, self.senses, q.T, strict=True
        ):
            axes.append((sense * R @ h, R @ point + p, turns))
            angle = (sense * value)[:, None, None]
            if turns:
                K = np.cross(np.eye(3), h)
                turn = np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * (K @ K)
                p = p + np.einsum("Nij,Nj->Ni", R, point - turn @ point)
                R = R @ turn
            else:
                p = p + np.einsum("Nij,Nj->Ni", R, angle[..., 0] * h)
        T = np.zeros((len(q), 4, 4))
        T[:, :3, :3], T[:, 3, 3] = R @ self.home[:3, :3], 1.0
        T[:, :3, 3] = R @ self.home[:3, 3] + p
        tip = T[:, :3, 3]
        columns = [
            np.hstack([np.cross(h, tip - point), h] if turns else [h, np.zeros_like(h)])
            for h, point, turns in axes
        ]
        return T, np.stack(columns, -1)


def share_led(robot: Robot, lines: Lines, nominal: SymbolicFunction) -> float:
    """The share of random configurations to which the nominal arm leads.

    Args:
        robot: The true arm.
        lines: Its axes.
        nominal: The task ``ik`` of the nominal arm; values of given joints follow the pose.

    Returns:
        From 0 to 1.
    """
    rng = np.random.default_rng(0)
    arm = _Arm.of(robot, lines)
    q = rng.uniform(-np.pi, np.pi, (SAMPLES, len(lines.axes)))
    T, _ = arm.pose_jacobian(q)
    given = q[:, list(nominal.role.given)]
    led = np.zeros(SAMPLES, dtype=bool)
    (kernel,) = lower([nominal], "nominal")
    for start in _branches(kernel, nominal, T, given):
        found, left = _polished(arm, T, start, nominal.role.given)
        apart = np.abs(np.remainder(found - q + np.pi, 2 * np.pi) - np.pi).max(-1)
        led |= (left < LED_BACK) & (apart < LED_BACK)
    return float(led.mean())


def _branches(
    kernel: ca.Function, nominal: SymbolicFunction, T: FloatArray, given: FloatArray
) -> list[FloatArray]:
    """The coordinates (N, n) of every branch."""
    inputs = [T.reshape(len(T), 16).T, *(values[None] for values in given.T)]
    if not nominal.signs:
        return [np.array(kernel(*inputs)[0]).T]
    return [
        np.array(kernel(*inputs, np.repeat(np.array(signs)[:, None], len(T), 1))[0]).T
        for signs in patterns(nominal)
    ]


def _polished(
    arm: _Arm, T: FloatArray, q: FloatArray, given: tuple[int, ...]
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
