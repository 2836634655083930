"""Lines and curves in task coordinates, such as the position and the pitch of the tool."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chasles import InputValueError, ShapeError
from chasles.summaries import short_repr

from ..arguments import finite, real
from .curves import PoseCurve, displacement, require_long, straight_line

FloatArray = NDArray[np.float64]
Task = Literal["position", "position_pitch", "planar"]


@dataclass(frozen=True, eq=False)
class TaskLine:
    """A straight line in task coordinates, such as the position and pitch of the tool.

    Attributes:
        start: (k,) task coordinates at the start [m, rad], as in `task_line`.
        end: (k,) task coordinates at the end [m, rad].
        task: "position", "position_pitch" or "planar".
        length: Distance between start and end positions [m]. If this distance is 0, `length` is the
            absolute change of the angle [rad].
    """

    start: FloatArray
    end: FloatArray
    task: Task
    length: float

    __repr__ = short_repr

    def at(self, s: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return task coordinates (m, k), first and second derivatives by s at s (m,)."""
        return straight_line(self.start, self.end, self.length, s)


def task_line(task: Task, start: ArrayLike, end: ArrayLike) -> TaskLine:
    """Return a straight line in task coordinates, for arms that cannot reach every orientation.

    Args:
        task: "position" for x, y, z of the tool origin [m]. "position_pitch" for x, y, z [m] and
            the elevation of the tool's z axis above the x-y plane [rad]. "planar" for x, y [m] and
            the tool angle in the x-y plane [rad]. All task coordinates refer to the base frame.
        start: (k,) task coordinates at the start [m, rad].
        end: (k,) task coordinates at the end [m, rad].

    Raises:
        ShapeError: `start` or `end` does not have the number of values of the task, 3 or 4.
        InputValueError: `task` is unknown, a value is not finite, or `start` and `end` are equal.
    """
    _require_task("task_line", task)
    a, b = real("task_line: start", start), real("task_line: end", end)
    count = 4 if task == "position_pitch" else 3
    if a.shape != (count,) or b.shape != (count,):
        raise ShapeError(f"task_line: task {task} has {count} values, got {a.shape} and {b.shape}")
    places = 2 if task == "planar" else 3
    vector = displacement(
        finite("task_line: start", a)[:places], finite("task_line: end", b)[:places]
    )
    length = float(np.linalg.norm(vector)) or float(np.linalg.norm((b - a)[places:]))
    require_long("task_line", length)
    return TaskLine(a, np.r_[a[:places] + vector, b[places:]], task, length)


@dataclass(frozen=True, eq=False)
class TaskCurve:
    """A curve of the tool origin in task coordinates, from `task_curve`.

    Attributes:
        curve: The curve of the tool origin.
        start: Tool pitch ("position_pitch") or tool angle ("planar") at the start [rad]. "position"
            ignores it.
        end: Tool pitch or tool angle at the end [rad]. The angle changes linearly with the length
            along the curve.
        task: "position", "position_pitch" or "planar".
        length: Length of the curve [m].
    """

    curve: PoseCurve
    start: float
    end: float
    task: Task
    length: float

    __repr__ = short_repr

    def at(self, s: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return task coordinates (m, k), first and second derivatives by s at s (m,)."""
        T, V, A = self.curve.at(s)
        places = 2 if self.task == "planar" else 3
        orders = [T[:, :places, 3], V[:, :places], A[:, :places]]
        if self.task != "position":
            slope = (self.end - self.start) / self.length
            angle = (self.start + slope * s, np.full(len(s), slope), np.zeros(len(s)))
            orders = [np.column_stack(pair) for pair in zip(orders, angle, strict=True)]
        return orders[0], orders[1], orders[2]


def task_curve(task: Task, curve: PoseCurve, start: float = 0.0, end: float = 0.0) -> TaskCurve:
    """Return a curve of the tool origin, for arms that cannot reach every orientation.

    Args:
        task: "position", "position_pitch" or "planar". `task_line` explains the tasks.
        curve: A curve of tool poses, such as a curve from `line` or `spline`. Only the positions of
            the tool origin are used.
        start: Tool pitch ("position_pitch") or tool angle ("planar") at the start [rad]. "position"
            ignores it.
        end: Tool pitch or tool angle at the end [rad]. The angle changes linearly with the length
            along the curve.

    Raises:
        InputValueError: `task` is unknown, or an angle is not finite.
    """
    _require_task("task_curve", task)
    first, last = finite("task_curve: start and end", [start, end])
    return TaskCurve(curve, float(first), float(last), task, curve.length)


def _require_task(name: str, task: str) -> None:
    if task not in get_args(Task):
        raise InputValueError(f"{name}: expected one of {', '.join(get_args(Task))}, got {task!r}")
