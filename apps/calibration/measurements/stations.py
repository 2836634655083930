"""Positions of targets from several stations of a device, each in an unknown frame of its own.

A laser tracker is moved where it does not see all targets. The first station's frame is W; that of
station s is T_W_station[s], found along with the robot:

    y_ij = inverse(T_W_station[s]) T_W_base (T_i x_j),   s the station at configuration i
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from chasles import InputValueError, se3

from .frames import register_points, targets_at, transformation
from .tool_measurements import (
    LEFT_HANDED,
    SMALL,
    Measurements,
    Positions,
    Start,
    points_on_tool,
    stated,
)

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.intp]

_LINE = 1e-3
"""Spread of positions across a line [m] below which they leave a turn about it open."""
_MOVED = ("x", "y", "z", "rx", "ry", "rz")


@dataclass(frozen=True, eq=False)
class StationPositions(Measurements):
    """Positions of targets whose places on the tool are unknown, from stations with unknown frames.

    Each station measures at least three positions that are not on a line.

    Attributes:
        points: (N, m, 3) positions of m targets in the frame of the configuration's station [m],
            NaN where a target was not seen.
        station: (N,) number of the station at each configuration, from 0.
        sigma: Standard deviation of a coordinate [m].
        T_W_station: (stations, 4, 4) their frames in that of the first one, which is W, as they are
            known before the parameters are; :meth:`frames` are those found along.
    """

    points: FloatArray
    station: IntArray
    sigma: float = SMALL
    T_W_station: FloatArray = field(default_factory=lambda: np.eye(4)[None])
    fixes_tool: ClassVar[bool] = False

    @property
    def count(self) -> int:
        """The number of stations."""
        return max(int(np.max(self.station)) + 1, len(self.T_W_station))

    @property
    def stated(self) -> str:
        """The standard deviation of a coordinate."""
        return stated(self.sigma)

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Places of the targets on the tool; small motions of all stations but the first."""
        moved = (f"station{s + 1}_{name}" for s in range(1, self.count) for name in _MOVED)
        return (*self._placed.unknowns, *moved)

    @property
    def rows(self) -> IntArray:
        """The target's number among those seen."""
        return self._placed.rows

    @property
    def labels(self) -> tuple[str, ...]:
        """Station, measurement and target, from 1."""
        at = self.station[self.configurations]
        return tuple(f"station {s + 1}, {t}" for s, t in zip(at, self._placed.labels, strict=True))

    @property
    def configurations(self) -> IntArray:
        """That of each target seen."""
        return self._placed.configurations

    @property
    def targets(self) -> tuple[str, ...]:
        """Their numbers, from 1."""
        return self._placed.targets

    def lengths(self, errors: FloatArray) -> FloatArray:
        """Distance of each target from where it was measured."""
        return self._placed.lengths(errors)

    def at(self, index: IntArray) -> Self:
        """The measurements of some configurations."""
        every = np.broadcast_to(self.T_W_station, (self.count, 4, 4))
        return replace(
            self, points=self.points[index], station=self.station[index], T_W_station=every
        )

    def placed_as(self, other: Self) -> Self:
        """The measurements with the other's frames of stations."""
        return replace(self, T_W_station=other.T_W_station)

    def scaled(self, factor: float) -> Self:
        """The measurements with all lengths times a factor."""
        scale = np.ones((4, 4))
        scale[:3, 3] = factor
        frames = scale * self.T_W_station
        return replace(self, points=factor * self.points, T_W_station=frames)

    def read_otherwise(self) -> Iterator[tuple[str, Self]]:
        """Mirrored frames of the device: every exchange of two axes is one, up to a turn."""
        yield LEFT_HANDED, replace(self, points=self.points * [-1.0, 1.0, 1.0])

    def frames(self, x: FloatArray) -> FloatArray:
        """(stations, 4, 4) frames of the stations in W, at the unknowns x."""
        known = np.broadcast_to(self.T_W_station, (self.count, 4, 4))
        return np.asarray(se3.exp(self._steps(x)) @ known)

    def start(self, T: FloatArray) -> Start:
        """By :func:`register_points` at the station that saw most, then one station after another.

        The targets are known from the first of them, so that the others' frames have a closed form.
        """
        seen = np.bincount(self.station[self.configurations], minlength=self.count)
        most = self.station == np.argmax(seen)
        found = register_points(T[most], self.points[most])
        placed = points_on_tool(T, found.points)
        # Frames of the base in those of the stations.
        of_base = [self._between(placed, s) for s in range(self.count)]
        T_W_station = of_base[0] @ se3.inverse(np.stack(of_base))
        measurements = replace(self, T_W_station=T_W_station)
        x = np.concatenate([found.points.ravel(), np.zeros(6 * (self.count - 1))])
        misfit = np.sqrt(np.mean(measurements.lengths(measurements.errors(of_base[0] @ T, x)) ** 2))
        return Start(of_base[0], x, measurements, float(misfit))

    def from_frame(self, T: FloatArray, start: Start) -> Start:
        """Targets at their mean places as the first station saw them, and the others by these."""
        first = self.station == 0
        targets = targets_at(T[first], self.points[first])
        placed = points_on_tool(T, targets)
        others = [se3.inverse(self._between(placed, s)) for s in range(1, self.count)]
        x = np.concatenate([targets.ravel(), np.zeros(6 * (self.count - 1))])
        measurements = replace(self, T_W_station=np.stack([np.eye(4), *others]))
        return start._replace(unknowns=x, measurements=measurements)

    def errors(self, T: FloatArray, x: FloatArray) -> FloatArray:
        """Computed less measured positions, in W."""
        return replace(self._placed, points=self._in_W(x)).errors(T, self._targets(x))

    def derivatives(
        self, T: FloatArray, J: FloatArray, x: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """As of positions; and -(v + omega x y) by a motion of a station, to its first order."""
        by_p, by_x = self._placed.derivatives(T, J, self._targets(x))
        seen = self._placed.seen
        y, at = self._in_W(x)[seen], self.station[self.configurations]
        moved = np.zeros((len(y), 3, 6 * (self.count - 1)))
        for k, axis in enumerate(np.eye(3)):
            by_v, by_omega = np.broadcast_to(axis, y.shape), np.cross(axis, y)
            for s in range(1, self.count):
                own, first = at == s, 6 * (s - 1)
                moved[own, :, first + k] = -by_v[own] / self.sigma
                moved[own, :, first + 3 + k] = -by_omega[own] / self.sigma
        return by_p, np.concatenate([by_x, moved.reshape(len(by_x), -1)], 1)

    @property
    def _placed(self) -> Positions:
        """The same as positions, without their frames."""
        return Positions(self.points, self.sigma)

    def _targets(self, x: FloatArray) -> FloatArray:
        return x[: 3 * self.points.shape[1]]

    def _steps(self, x: FloatArray) -> FloatArray:
        """(stations, 6) twists of the stations' motions in W; W stays."""
        return np.concatenate([np.zeros(6), x[3 * self.points.shape[1] :]]).reshape(-1, 6)

    def _in_W(self, x: FloatArray) -> FloatArray:
        F = self.frames(x)[self.station]
        turned = np.einsum("nij,nmj->nmi", F[:, :3, :3], self.points)
        return np.asarray(turned + F[:, None, :3, 3])

    def _between(self, placed: FloatArray, s: int) -> FloatArray:
        """The pose that carries points (N, m, 3) to those that station s measured."""
        own = (self.station == s)[:, None] & self._placed.seen
        apart = placed[own] - placed[own].mean(0) if own.any() else np.zeros((1, 3))
        if np.linalg.svd(apart, compute_uv=False)[1:2].sum() < _LINE:
            raise InputValueError(
                f"identify: station {s + 1} saw {own.sum()} targets; expected three or more that "
                "are not on a line, since its frame is found from them"
            )
        return transformation(placed[own], self.points[own])
