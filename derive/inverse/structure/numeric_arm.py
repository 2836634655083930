"""Numeric model of an arm that computes poses and Jacobians."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from ...model.robot import SerialRobot, Translation
from .lines import Lines, home_of, numbers

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class NumericArm:
    """Numeric model of an arm.

    Attributes:
        directions: Directions (n, 3) of the axes in the home pose.
        points: Points (n, 3) on the axes.
        turns: Flags (n,), True for revolute joints.
        senses: Signs (n,): 1 if a positive joint coordinate moves the joint along or about the axis
            direction, otherwise -1.
        home: Tool pose (4, 4) with all joints at zero.
        length: Arm length (meter).
        offsets: Components (meter) of all translations in the robot description.
    """

    directions: FloatArray
    points: FloatArray
    turns: NDArray[np.bool_]
    senses: FloatArray
    home: FloatArray
    length: float
    offsets: FloatArray

    @classmethod
    def of(cls, robot: SerialRobot, lines: Lines) -> "NumericArm":
        """Build the numeric model of a robot, without the axes that chasles added to the robot."""
        home = numbers(lines.terms, home_of(robot, lines.terms)).reshape(4, 4)
        axes = [axis for axis in lines.axes if axis.joint < len(robot.moving)]
        return cls(
            np.array([axis.direction for axis in axes]),
            np.array([axis.origin for axis in axes]),
            np.array([axis.turns for axis in axes]),
            np.array([float(joint.direction) for joint in robot.moving]),
            home,
            lines.length or 1.0,
            np.array([float(lines.terms.value(component)) for component in _offsets(robot)]),
        )

    def pose_jacobian(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return tool poses (N, 4, 4) and mixed Jacobians (N, 6, n) at coordinates q (N, n)."""
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


def _offsets(robot: SerialRobot) -> Iterator[sp.Expr]:
    placements = [placement for joint in robot.joints for placement in (joint.before, joint.after)]
    for placement in (robot.base, *placements, robot.tool):
        for motion in placement:
            if isinstance(motion, Translation):
                yield from motion.vector
