"""Positions measured while one joint turns: circles, whose axes place the robot in the device.

With the angle t_i of the joint, known but for its zero, a target moves on

    y_i = c + a cos t_i + b sin t_i,

which is linear in c, a and b. The axis goes through c along a x b, with the sense of the turn. The
nominal axes of the same joints, seen in the base frame, are carried onto the measured ones by the
base frame in the device's: a start that needs no search, and an axis a joint to look at.

Source:
    B. W. Mooring, Z. S. Roth, M. R. Driels, Fundamentals of Manipulator Calibration, 1991, chapter
    5, for circle-point analysis.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from chasles import InputValueError, se3, so3

from .frames import register_axes, targets_at
from .tool_measurements import Positions, Start, points_on_tool

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]

LEAST_TURN = 0.2
"""Radians that a joint must turn on its circle: a shorter arc leaves its centre uncertain."""


@dataclass(frozen=True)
class MeasuredAxis:
    """An axis about which positions move on circles.

    Attributes:
        direction: (3,) its direction, with the sense of the joint's turn.
        point: (3,) a point on it [m].
        error: Root mean square distance of the positions from their circles [m].
    """

    direction: FloatArray
    point: FloatArray
    error: float


@dataclass(frozen=True, eq=False)
class CirclePoints(Positions):
    """Positions of targets, measured while one joint after the other turns.

    Attributes:
        points: (N, m, 3) as of :class:`Positions`.
        sigma: Standard deviation of a coordinate [m].
        circle: (N,) the number of the circle to which each configuration belongs; negative of none.
    """

    circle: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.intp))

    def at(self, index: IntArray) -> Self:
        """The measurements of some configurations."""
        return replace(self, points=self.points[index], circle=self.circle[index])

    def axes(self, T: FloatArray) -> tuple[MeasuredAxis, ...]:
        """The axis of each circle in W, fitted to the measured positions.

        Args:
            T: (N, 4, 4) poses of the nominal tool, which give the angles.

        Raises:
            InputValueError: The tool does not turn about one axis on a circle, by 0.2 rad or more.
        """
        return tuple(
            _fitted(self.points[self.circle == k], _turned(T[self.circle == k], k)[1])
            for k in self._numbers()
        )

    def start(self, T: FloatArray) -> Start:
        """The base frame by the axes; as for positions where they do not determine it."""
        nominal = [_turned(T[self.circle == k], k)[0] for k in self._numbers()]
        T_W_base = register_axes(_lines(nominal), _lines(self.axes(T)))
        if T_W_base is None:
            return super().start(T)
        points = targets_at(T_W_base @ T, self.points)
        apart = np.linalg.norm(points_on_tool(T_W_base @ T, points) - self.points, axis=-1)
        misfit = float(np.sqrt(np.mean(apart[self.seen] ** 2)))
        return Start(T_W_base, points.ravel(), self, misfit)

    def _numbers(self) -> list[int]:
        return [int(k) for k in np.unique(self.circle) if k >= 0]


def _turned(T: FloatArray, circle: int) -> tuple[MeasuredAxis, FloatArray]:
    """The axis about which poses turn, in the base frame, and the angle of each from the first."""
    apart = T @ se3.inverse(T[0])
    turns = so3.log(apart[:, :3, :3])
    direction = np.linalg.svd(turns)[2][0]
    if direction @ turns.sum(0) < 0:
        direction = -direction
    angles = turns @ direction
    if np.ptp(angles) < LEAST_TURN or np.abs(turns - np.outer(angles, direction)).max() > _STRAY:
        raise InputValueError(
            f"circle {circle}: the tool does not turn about one axis by {LEAST_TURN} rad or more; "
            "expected configurations in which one turning joint moves alone"
        )
    rows = (np.eye(3) - apart[:, :3, :3]).reshape(-1, 3)
    point = np.asarray(np.linalg.lstsq(rows, apart[:, :3, 3].ravel(), rcond=_STRAY)[0])
    return MeasuredAxis(direction, point, 0.0), angles


_STRAY = 1e-6
"""Radians by which poses of one joint alone may turn about another axis: coordinates are repeated
to rounding, or written to a table with six digits. Likewise the part of a singular value below
which a shift along the axis is none."""


def _fitted(points: FloatArray, angles: FloatArray) -> MeasuredAxis:
    """The common axis of the circles of all targets (N, m, 3), by c + a cos t + b sin t each."""
    rows = np.column_stack([np.ones(len(angles)), np.cos(angles), np.sin(angles)])
    normal, centres, errors = np.zeros(3), [], []
    for own in np.moveaxis(points, 1, 0):
        seen = np.isfinite(own).all(-1)
        if seen.sum() <= rows.shape[1]:
            continue
        c, a, b = np.linalg.lstsq(rows[seen], own[seen])[0]
        normal += np.cross(a, b)
        centres.append(c)
        errors.append(((rows[seen] @ np.stack([c, a, b]) - own[seen]) ** 2).sum(-1).mean())
    if not centres:
        raise InputValueError("a circle needs one target that is seen in four configurations")
    return MeasuredAxis(
        normal / np.linalg.norm(normal),
        np.mean(centres, axis=0),
        float(np.sqrt(np.mean(errors))),
    )


def _lines(axes: Sequence[MeasuredAxis]) -> tuple[FloatArray, FloatArray]:
    """Directions (k, 3) and points (k, 3)."""
    return np.array([axis.direction for axis in axes]), np.array([axis.point for axis in axes])
