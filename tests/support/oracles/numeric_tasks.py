"""Reachable poses for tests of iterative inverse kinematics, and the number of missed poses."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import chasles

COMPARED = ("ur5e", "puma560", "panda")
"""Robots that the Robotics Toolbox solves as well."""
ALONE = (
    *("iiwa14", "photo_robot", "lynxmotion", "jaco2"),
    *("well_manipulator", "board_installer", "stewart_gough"),
)
"""Robots that no other library can solve."""
DIRECTION = (1, 1, 1, 1, 1, 0)
"""Weights of the six pose components for five-joint arms.

The rotation about the tool's z axis has weight 0.
"""
WEIGHTS = {"lynxmotion": DIRECTION}
"""Weights of the pose components, keyed by robot. The arm `lynxmotion` stands on a turntable, so
its tool position determines the yaw of the tool. The target of `lynxmotion` also includes the pitch
of the tool."""
TOLERANCE = 1e-9
ROUNDING = 1e-13
"""Maximum difference between single and batch computation of the same pose [m or rad]."""


@dataclass(frozen=True)
class NumericTask:
    """Poses reachable by a robot within its limits.

    Attributes:
        robot: The robot.
        T: (m, 4, 4) poses.
        weights: Weights of the components of the pose error, or None if all components have equal
            weights.
    """

    robot: chasles.Robot
    T: np.ndarray
    weights: tuple[int, ...] | None

    def solve(self, T: np.ndarray, threads: int = 1):
        """Solve the iterative inverse kinematics of a single pose or a batch of poses."""
        return self.robot.ik_numeric(T, task_weights=self.weights, threads=threads)


def numeric_task(name: str, count: int) -> NumericTask:
    """Return poses at random coordinates within limits.

    Joints without limits move by at most half a turn or one meter in each direction.
    """
    robot = chasles.load(name)
    reach = np.array([np.pi if c.unit == "rad" else 1.0 for c in robot.coordinates])
    lower = np.where(np.isfinite(robot.lower), robot.lower, -reach)
    upper = np.where(np.isfinite(robot.upper), robot.upper, reach)
    rng = np.random.default_rng(1)
    T = np.empty((0, 4, 4))
    while len(T) < count:
        more = robot.fk(rng.uniform(lower, upper, (count, robot.n)))
        T = np.vstack([T, more[np.isfinite(more).all((1, 2))]])
    return NumericTask(robot, T[:count], WEIGHTS.get(name))


def errors(task: NumericTask, results: Sequence[Any]) -> np.ndarray:
    """Return pose errors (m,) [m or rad], with NaN for poses without a valid solution."""
    robot = task.robot
    q = np.array([result.q for result in results])
    claimed = np.array([bool(result.valid) for result in results])
    within = ((q >= robot.lower) & (q <= robot.upper)).all(axis=1)
    return np.where(claimed & within, pose_error(task, robot.fk(q)), np.nan)


def pose_error(task: NumericTask, T: np.ndarray) -> np.ndarray:
    """Return pose errors (m,), each the larger of the distance [m] and the angle [rad]."""
    distance = np.linalg.norm(T[:, :3, 3] - task.T[:, :3, 3], axis=1)
    columns = slice(2, 3) if task.weights == DIRECTION else slice(0, 3)
    sides = np.linalg.norm(T[:, :3, columns] - task.T[:, :3, columns], axis=(1, 2))
    # A small rotation about a tool axis moves the end points of the two other unit axes by the
    # rotation angle. The norm of the differences of all three unit axes is therefore divided by
    # sqrt(2), which gives the rotation angle. If the task weights are DIRECTION, only the z axes of
    # the poses are compared.
    return np.maximum(distance, sides if task.weights == DIRECTION else sides / np.sqrt(2))


def missed(task: NumericTask) -> int:
    """Count poses for which chasles finds no valid solution within the limits."""
    error = errors(task, [task.solve(pose) for pose in task.T])
    return int(np.count_nonzero(~(error <= TOLERANCE + ROUNDING)))
