"""Circle point analysis: positions measured while one joint at a time rotates.

While one joint rotates, a target on the tool moves on a circle with center c. The joint angles t_i
have an unknown common offset. For two perpendicular radius vectors a and b, the target positions
y_i are:

    y_i = c + a cos t_i + b sin t_i

The circle equation is linear in the vectors c, a and b. The joint axis passes through the circle
center c in the direction a x b. A fit of the nominal axes to the measured axes gives the base frame
in the device frame.

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

MIN_TURN = 0.2
"""Minimum rotation of the tool along a circle [rad]."""


@dataclass(frozen=True)
class MeasuredAxis:
    """A joint axis, fitted to positions in the device frame W or to tool poses in the base frame.

    Attributes:
        direction: (3,) unit vector along the joint axis. On average, the tool rotates right-handed
            about this vector from its first pose on the circle.
        point: (3,) a point on the axis [m].
        error: Root mean square distance of the measured positions from the fitted circles [m].
    """

    direction: FloatArray
    point: FloatArray
    error: float


@dataclass(frozen=True, eq=False)
class CirclePoints(Positions):
    """Positions of targets on the tool, measured while one joint at a time rotates.

    Attributes:
        points: (N, m, 3) positions of m targets in W [m], NaN for invisible targets.
        sigma: Standard deviation of each position coordinate [m].
        circle: (N,) index of the circle to which each configuration belongs, negative for
            configurations of no circle.
    """

    circle: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.intp))

    def at(self, index: IntArray) -> Self:
        """Return the measurements at the configurations `index`."""
        return replace(self, points=self.points[index], circle=self.circle[index])

    def axes(self, T: FloatArray) -> tuple[MeasuredAxis, ...]:
        """Return the axis of each circle in W, fitted to the measured positions.

        Args:
            T: (N, 4, 4) tool poses of the nominal robot in the base frame.

        Raises:
            InputValueError: Along one of the circles, the tool rotates by less than 0.2 rad, or
                about more than one axis.
        """
        return tuple(
            _fitted(self.points[self.circle == k], _turned(T[self.circle == k], k)[1])
            for k in self._numbers()
        )

    def _start(self, T: FloatArray) -> Start:
        """Estimate the base frame from the axes, or from the positions if all axes are parallel."""
        nominal = [_turned(T[self.circle == k], k)[0] for k in self._numbers()]
        T_W_base = register_axes(_lines(nominal), _lines(self.axes(T)))
        if T_W_base is None:
            return super()._start(T)
        points = targets_at(T_W_base @ T, self.points)
        apart = np.linalg.norm(points_on_tool(T_W_base @ T, points) - self.points, axis=-1)
        misfit = float(np.sqrt(np.mean(apart[self._seen] ** 2)))
        return Start(T_W_base, points.ravel(), self, misfit)

    def _numbers(self) -> list[int]:
        return [int(k) for k in np.unique(self.circle) if k >= 0]


def _turned(T: FloatArray, circle: int) -> tuple[MeasuredAxis, FloatArray]:
    """Return the tool's rotation axis in the base frame, and angles relative to the first pose."""
    apart = T @ se3.inverse(T[0])
    turns = so3.log(apart[:, :3, :3])
    direction = np.linalg.svd(turns)[2][0]
    if direction @ turns.sum(0) < 0:
        direction = -direction
    angles = turns @ direction
    if np.ptp(angles) < MIN_TURN or np.abs(turns - np.outer(angles, direction)).max() > _STRAY:
        raise InputValueError(
            f"circle {circle}: the tool does not rotate enough about one axis; expected "
            "configurations in which only one revolute joint moves, by at least "
            f"{MIN_TURN} rad"
        )
    rows = (np.eye(3) - apart[:, :3, :3]).reshape(-1, 3)
    point = np.asarray(np.linalg.lstsq(rows, apart[:, :3, 3].ravel(), rcond=_STRAY)[0])
    return MeasuredAxis(direction, point, 0.0), angles


_STRAY = 1e-6
"""Tolerance for tool rotation about axes other than the circle axis [rad]. The tolerance permits
coordinates that are rounded to six digits. The axis position is undetermined along a direction if
the relative singular value is below this tolerance."""


def _fitted(points: FloatArray, angles: FloatArray) -> MeasuredAxis:
    """Fit a circle to each of m targets in `points` (N, m, 3).

    Return the axis that all circles share.
    """
    rows = np.column_stack([np.ones(len(angles)), np.cos(angles), np.sin(angles)])
    normal, centers, errors = np.zeros(3), [], []
    for own in np.moveaxis(points, 1, 0):
        seen = np.isfinite(own).all(-1)
        if seen.sum() <= rows.shape[1]:
            continue
        c, a, b = np.linalg.lstsq(rows[seen], own[seen])[0]
        normal += np.cross(a, b)
        centers.append(c)
        errors.append(((rows[seen] @ np.stack([c, a, b]) - own[seen]) ** 2).sum(-1).mean())
    if not centers:
        raise InputValueError("a circle requires a target that is visible in four configurations")
    return MeasuredAxis(
        normal / np.linalg.norm(normal),
        np.mean(centers, axis=0),
        float(np.sqrt(np.mean(errors))),
    )


def _lines(axes: Sequence[MeasuredAxis]) -> tuple[FloatArray, FloatArray]:
    return np.array([axis.direction for axis in axes]), np.array([axis.point for axis in axes])
