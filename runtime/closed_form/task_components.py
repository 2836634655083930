"""Pose components of inverse kinematics tasks.

The manifest lists the components in input order.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from ..arrays import FloatArray
from ..contract import TASK_COMPONENTS, FunctionInfo, Manifest, TaskName
from ..errors import InputValueError
from .polish import Measured, of_pose


@dataclass(frozen=True, slots=True)
class Part:
    """A component of a task.

    Attributes:
        is_length: Whether the error is a distance [m], not an angle.
        entries: Maps poses (N, 4, 4) to task inputs (N, size).
        measure: Maps poses (N, 4, 4), Jacobians (N, 6, n) and task inputs (N, size) to Jacobian
            rows, errors and error norms.
    """

    is_length: bool
    entries: Callable[[FloatArray], FloatArray]
    measure: Callable[[FloatArray, FloatArray, FloatArray], Measured]


@dataclass(frozen=True, slots=True)
class Task:
    """The names of the components of a task, empty for a whole pose."""

    components: tuple[str, ...] = ()

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of the task input."""
        if "orientation" in self.components:
            return (3, 3)
        size = sum(TASK_COMPONENTS[component] for component in self.components)
        return (size,) if self.components else (4, 4)

    def __call__(self, pose: FloatArray, J: FloatArray, target: FloatArray) -> Measured:
        """Return Jacobian rows (N, m, n), errors (N, m) and the largest component errors (N,)."""
        if not self.components:
            return of_pose(pose, J, target)
        measured = [
            PARTS[component].measure(pose, J, target[:, entries])
            for component, entries in self._entries()
        ]
        rows, errors, sizes = zip(*measured, strict=True)
        return np.concatenate(rows, 1), np.concatenate(errors, 1), np.maximum.reduce(sizes)

    def of(self, T: FloatArray) -> FloatArray:
        """Return the task inputs (N, *shape) of poses (N, 4, 4)."""
        return (
            np.hstack([PARTS[component].entries(T) for component in self.components])
            if self.components
            else T
        )

    def divided(self, target: FloatArray, unit: float) -> FloatArray:
        """Return targets (N, ...) with lengths divided by a unit [m]."""
        target = np.array(target)
        if not self.components:
            target[..., :3, 3] /= unit
            return target
        for component, entries in self._entries():
            if PARTS[component].is_length:
                target[:, entries] /= unit
        return target

    def _entries(self) -> Iterator[tuple[str, slice]]:
        first = 0
        for component in self.components:
            yield component, slice(first, first + TASK_COMPONENTS[component])
            first += TASK_COMPONENTS[component]


WHOLE = Task()
"""The complete pose."""


def _position(pose: FloatArray, J: FloatArray, p: FloatArray) -> Measured:
    error = p - pose[:, : p.shape[1], 3]
    return J[:, : p.shape[1]], error, np.sqrt((error * error).sum(-1))


def _direction(pose: FloatArray, J: FloatArray, u: FloatArray) -> Measured:
    z = pose[:, :3, 2]
    u = u / np.sqrt((u * u).sum(-1, keepdims=True))
    across = np.cross(z, u)
    sine = np.sqrt((across * across).sum(-1))
    angle = np.arctan2(sine, (z * u).sum(-1))
    turn = across * np.where(sine > 0, angle / np.where(sine > 0, sine, 1.0), 0.0)[:, None]
    own = pose[:, :3, :2].mT
    error = (own @ turn[..., None])[..., 0]
    return own @ J[:, 3:], error, np.sqrt(((z - u) ** 2).sum(-1))


def _orientation(pose: FloatArray, J: FloatArray, R: FloatArray) -> Measured:
    there = pose.copy()
    there[:, :3, :3] = R
    rows, error, residual = of_pose(pose, J, there)
    return rows[:, 3:], error[:, 3:], residual


def _pitch(pose: FloatArray, J: FloatArray, pitch: FloatArray) -> Measured:
    x, y, rise = pose[:, :3, 2].T
    level = np.hypot(x, y)
    sine, cosine = np.sin(pitch[:, 0]), np.abs(np.cos(pitch[:, 0]))
    error = np.arctan2(sine, cosine) - np.arctan2(rise, level)
    # A vertical tool axis has no heading. The heading of the tool's x axis is used instead.
    upright = level == 0
    c = np.where(upright, pose[:, 0, 0], x / np.where(upright, 1.0, level))
    s = np.where(upright, pose[:, 1, 0], y / np.where(upright, 1.0, level))
    row = s[:, None] * J[:, 3] - c[:, None] * J[:, 4]
    return row[:, None], error[:, None], np.hypot(rise - sine, level - cosine)


def _heading(pose: FloatArray, J: FloatArray, heading: FloatArray) -> Measured:
    c, s = np.cos(heading[:, 0]), np.sin(heading[:, 0])
    x, y = pose[:, 0, 0], pose[:, 1, 0]
    error = np.arctan2(x * s - y * c, x * c + y * s)
    return J[:, 5:], error[:, None], np.hypot(x - c, y - s)


def _pitch_of(T: FloatArray) -> FloatArray:
    x, y, rise = T[:, :3, 2].T
    return np.asarray(np.arctan2(rise, np.hypot(x, y))[:, None])


PARTS: Mapping[str, Part] = {
    "position": Part(True, lambda T: T[:, :3, 3], _position),
    "plane": Part(True, lambda T: T[:, :2, 3], _position),
    "orientation": Part(False, lambda T: T[:, :3, :3], _orientation),
    "direction": Part(False, lambda T: T[:, :3, 2], _direction),
    "pitch": Part(False, _pitch_of, _pitch),
    "heading": Part(False, lambda T: np.arctan2(T[:, 1, :1], T[:, 0, :1]), _heading),
}
"""The components of a pose that a task can prescribe, by their names in the manifest."""


def inverse_for(manifest: Manifest, method: str, task: TaskName) -> FunctionInfo:
    """Return the manifest entry of the IK function for a task, or raise an InputValueError."""
    inverses = manifest.inverses
    if task not in inverses:
        raise InputValueError(
            f"{manifest.name}.{method}: the robot has no inverse for task {task!r}; it has "
            f"{', '.join(inverses)}"
        )
    return inverses[task]
