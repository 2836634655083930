"""What an inverse asks of the tool: parts of a pose, their errors, and rows of the Jacobian.

A task is made of parts, such as the position and the direction of the tool's third axis, which the
manifest lists in the order of the entries of the task's input. A part gives the error of a pose
from these entries, and the rows of the Jacobian that reduce it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..arrays import FloatArray
from ..contract import AIMS, FunctionInfo, Manifest
from ..errors import InputValueError
from .polish import Measured, of_pose


@dataclass(frozen=True, slots=True)
class Part:
    """A part of a task.

    Attributes:
        is_length: Whether its error is a distance [m], not an angle.
        entries: The entries (N, size) of poses (N, 4, 4).
        measure: The rows, the error and its size of poses (N, 4, 4) with Jacobians (N, 6, n) from
            entries (N, size).
    """

    is_length: bool
    entries: Callable[[FloatArray], FloatArray]
    measure: Callable[[FloatArray, FloatArray, FloatArray], Measured]


@dataclass(frozen=True, slots=True)
class Task:
    """The measure of all parts of a task, or of a whole pose; see :data:`polish.Measure`.

    Attributes:
        aims: The names of the parts; () for a whole pose.
    """

    aims: tuple[str, ...] = ()

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of the input."""
        return (sum(AIMS[aim] for aim in self.aims),) if self.aims else (4, 4)

    def __call__(self, pose: FloatArray, J: FloatArray, target: FloatArray) -> Measured:
        """Rows (N, m, n), errors (N, m) and the largest size (N,) of the parts' errors."""
        if not self.aims:
            return of_pose(pose, J, target)
        measured = [
            PARTS[aim].measure(pose, J, target[:, entries]) for aim, entries in self._entries()
        ]
        rows, errors, sizes = zip(*measured, strict=True)
        return np.concatenate(rows, 1), np.concatenate(errors, 1), np.maximum.reduce(sizes)

    def of(self, T: FloatArray) -> FloatArray:
        """The input (N, *shape) that poses (N, 4, 4) give."""
        return np.hstack([PARTS[aim].entries(T) for aim in self.aims]) if self.aims else T

    def divided(self, target: FloatArray, unit: float) -> FloatArray:
        """Targets (N, ...) with their lengths in a unit [m]."""
        target = np.array(target)
        if not self.aims:
            target[..., :3, 3] /= unit
            return target
        for aim, entries in self._entries():
            if PARTS[aim].is_length:
                target[:, entries] /= unit
        return target

    def _entries(self) -> Iterator[tuple[str, slice]]:
        """Each part, and its entries in the input."""
        first = 0
        for aim in self.aims:
            yield aim, slice(first, first + AIMS[aim])
            first += AIMS[aim]


WHOLE = Task()
"""The whole pose."""


def _position(pose: FloatArray, J: FloatArray, p: FloatArray) -> Measured:
    error = p - pose[:, : p.shape[1], 3]
    return J[:, : p.shape[1]], error, np.sqrt((error * error).sum(-1))


def _direction(pose: FloatArray, J: FloatArray, u: FloatArray) -> Measured:
    """The turn of the tool's third axis to a direction, about the tool's first and second axes."""
    z = pose[:, :3, 2]
    u = u / np.sqrt((u * u).sum(-1, keepdims=True))
    across = np.cross(z, u)
    sine = np.sqrt((across * across).sum(-1))
    angle = np.arctan2(sine, (z * u).sum(-1))
    turn = across * np.where(sine > 0, angle / np.where(sine > 0, sine, 1.0), 0.0)[:, None]
    own = pose[:, :3, :2].mT
    error = (own @ turn[..., None])[..., 0]
    return own @ J[:, 3:], error, np.sqrt(((z - u) ** 2).sum(-1))


def _pitch(pose: FloatArray, J: FloatArray, pitch: FloatArray) -> Measured:
    """The elevation of the tool's third axis; beyond a right angle the axis leans backwards."""
    x, y, rise = pose[:, :3, 2].T
    level = np.hypot(x, y)
    sine, cosine = np.sin(pitch[:, 0]), np.abs(np.cos(pitch[:, 0]))
    error = np.arctan2(sine, cosine) - np.arctan2(rise, level)
    # An axis that points up or down leans any way; the rate does not vanish with the level part.
    upright = level == 0
    c = np.where(upright, pose[:, 0, 0], x / np.where(upright, 1.0, level))
    s = np.where(upright, pose[:, 1, 0], y / np.where(upright, 1.0, level))
    row = s[:, None] * J[:, 3] - c[:, None] * J[:, 4]
    return row[:, None], error[:, None], np.hypot(rise - sine, level - cosine)


def _heading(pose: FloatArray, J: FloatArray, heading: FloatArray) -> Measured:
    """The angle of the tool's first axis in the base's x-y plane."""
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
    "direction": Part(False, lambda T: T[:, :3, 2], _direction),
    "pitch": Part(False, _pitch_of, _pitch),
    "heading": Part(False, lambda T: np.arctan2(T[:, 1, :1], T[:, 0, :1]), _heading),
}
"""The parts of a pose that a task can prescribe, by their names in the manifest."""

TaskName = Literal["pose", "position", "position_pitch", "position_direction", "planar"]
TASKS: Mapping[TaskName, tuple[str, ...]] = {
    "pose": (),
    "position": ("position",),
    "position_pitch": ("position", "pitch"),
    "position_direction": ("position", "direction"),
    "planar": ("plane", "heading"),
}
"""What `ik_path` and `ik_nearest` can ask of a pose: its parts, () for the whole of it."""


def inverses_of(manifest: Manifest) -> dict[TaskName, FunctionInfo]:
    """The inverses of a robot by their tasks."""
    found: dict[TaskName, FunctionInfo] = {}
    for task, aims in TASKS.items():
        for info in manifest.functions:
            role = info.role
            if role.is_inverse and role.aims == aims and (aims or role.domain == "pose"):
                found.setdefault(task, info)
    return found


def inverse_for(manifest: Manifest, method: str, task: TaskName) -> FunctionInfo:
    """The inverse that takes a part of a pose.

    Raises:
        InputValueError: If the robot has none.
    """
    inverses = inverses_of(manifest)
    if task not in inverses:
        raise InputValueError(
            f"{manifest.name}.{method}: the robot has no inverse for task {task!r}; it has "
            f"{', '.join(inverses)}"
        )
    return inverses[task]
