"""Target positions that a device measures from several stations with unknown poses.

If a laser tracker cannot see all targets from one station, the tracker is moved to other stations.
The device frame W is the frame of the first station. The identification estimates the frame
T_W_station[s] of each station s together with the robot parameters. A measured target position y_ij
follows from the base frame, the tool pose T_i and the target position x_j in the tool frame:

    y_ij = inverse(T_W_station[s]) T_W_base (T_i x_j), with s the station at configuration i
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
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
"""Target positions count as collinear if their spread perpendicular to a line is smaller than this
value [m]."""
_MOVED = ("x", "y", "z", "rx", "ry", "rz")


@dataclass(frozen=True, eq=False)
class StationPositions(Measurements):
    """Positions of unknown targets on the tool, measured from stations with unknown frames.

    From each station, the device must measure at least three positions that are not collinear.

    Attributes:
        points: (N, m, 3) positions of m targets in the station frame of each configuration [m],
            NaN for invisible targets.
        station: (N,) station index of each configuration, from 0.
        sigma: Standard deviation of each position coordinate [m].
        T_W_station: (stations, 4, 4) station frames in the frame W of the first station, estimated
            before the identification. The method ``frames`` returns the identified station frames.
    """

    points: FloatArray
    station: IntArray
    sigma: float = SMALL
    T_W_station: FloatArray = field(default_factory=lambda: np.eye(4)[None])
    _n_frame_unknowns: ClassVar[int] = 6
    _fixes_tool: ClassVar[bool] = False
    _shapes: ClassVar[Mapping[str, tuple[int | None, ...]]] = {"points": (None, None, 3)}

    @property
    def count(self) -> int:
        """The number of stations from which the targets were measured."""
        return max(int(np.max(self.station)) + 1, len(self.T_W_station))

    @property
    def _stated(self) -> str:
        return stated(self.sigma)

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Names of the unknown target coordinates, then names of the station pose corrections."""
        moved = (f"station{s + 1}_{name}" for s in range(1, self.count) for name in _MOVED)
        return (*self._placed.unknowns, *moved)

    @property
    def rows(self) -> IntArray:
        """Index of the measurement row of each error.

        A row is one visible target at one configuration.
        """
        return self._placed.rows

    @property
    def labels(self) -> tuple[str, ...]:
        """Label of each measurement row: station, measurement and target, counted from 1."""
        at = self.station[self.configurations]
        return tuple(f"station {s + 1}, {t}" for s, t in zip(at, self._placed.labels, strict=True))

    @property
    def configurations(self) -> IntArray:
        """Index of the configuration at which each visible target was measured."""
        return self._placed.configurations

    @property
    def targets(self) -> tuple[str, ...]:
        """Name of the target in each measurement row, numbered from 1."""
        return self._placed.targets

    def _lengths(self, errors: FloatArray) -> FloatArray:
        return self._placed._lengths(errors)

    def at(self, index: IntArray) -> Self:
        """Return the measurements at the configurations `index`."""
        every = np.broadcast_to(self.T_W_station, (self.count, 4, 4))
        return replace(
            self, points=self.points[index], station=self.station[index], T_W_station=every
        )

    def _placed_as(self, other: Self) -> Self:
        return replace(self, T_W_station=other.T_W_station)

    def _scaled(self, factor: float) -> Self:
        scale = np.ones((4, 4))
        scale[:3, 3] = factor
        frames = scale * self.T_W_station
        return replace(self, points=factor * self.points, T_W_station=frames)

    def _read_otherwise(self) -> Iterator[tuple[str, Self]]:
        """Yield the measurements with mirrored x coordinates, for a left-handed device frame."""
        yield LEFT_HANDED, replace(self, points=self.points * [-1.0, 1.0, 1.0])

    def frames(self, x: FloatArray) -> FloatArray:
        """Return the station frames (stations, 4, 4) in W for given values x of the unknowns."""
        known = np.broadcast_to(self.T_W_station, (self.count, 4, 4))
        return np.asarray(se3.exp(self._steps(x)) @ known)

    def _start(self, T: FloatArray) -> Start:
        """Estimate the base frame, the target positions and the frames of the stations.

        The estimate starts with the station that measured the most targets.

        ``register_points`` estimates the target positions from the measurements of this
        station. The targets then determine the frames of the other stations in closed form.
        """
        seen = np.bincount(self.station[self.configurations], minlength=self.count)
        most = self.station == np.argmax(seen)
        found = register_points(T[most], self.points[most])
        placed = points_on_tool(T, found.points)
        # `of_base` contains the pose of the robot base in the frame of each station.
        of_base = [self._between(placed, s) for s in range(self.count)]
        T_W_station = of_base[0] @ se3.inverse(np.stack(of_base))
        measurements = replace(self, T_W_station=T_W_station)
        x = np.concatenate([found.points.ravel(), np.zeros(6 * (self.count - 1))])
        errors = measurements._errors(of_base[0] @ T, x)
        misfit = np.sqrt(np.mean(measurements._lengths(errors) ** 2))
        return Start(of_base[0], x, measurements, float(misfit))

    def _from_frame(self, T: FloatArray, start: Start) -> Start:
        """Estimate the target positions from the measurements at station 1, for a known base frame.

        The target positions then determine the frames of the other stations.
        """
        first = self.station == 0
        targets = targets_at(T[first], self.points[first])
        placed = points_on_tool(T, targets)
        others = [se3.inverse(self._between(placed, s)) for s in range(1, self.count)]
        x = np.concatenate([targets.ravel(), np.zeros(6 * (self.count - 1))])
        measurements = replace(self, T_W_station=np.stack([np.eye(4), *others]))
        return start._replace(unknowns=x, measurements=measurements)

    def _errors(self, T: FloatArray, x: FloatArray) -> FloatArray:
        return replace(self._placed, points=self._in_W(x))._errors(T, self._targets(x))

    def _derivatives(
        self, T: FloatArray, J: FloatArray, x: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        by_p, by_x = self._placed._derivatives(T, J, self._targets(x))
        seen = self._placed._seen
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
        """The measured points as `Positions`, still in the station frame of each configuration."""
        return Positions(self.points, self.sigma)

    def _targets(self, x: FloatArray) -> FloatArray:
        return x[: 3 * self.points.shape[1]]

    def _steps(self, x: FloatArray) -> FloatArray:
        """Return the station frame corrections as twists (stations, 6).

        The twist of the first measurement station is 0, because its frame is the device frame W.
        """
        return np.concatenate([np.zeros(6), x[3 * self.points.shape[1] :]]).reshape(-1, 6)

    def _in_W(self, x: FloatArray) -> FloatArray:
        F = self.frames(x)[self.station]
        turned = np.einsum("nij,nmj->nmi", F[:, :3, :3], self.points)
        return np.asarray(turned + F[:, None, :3, 3])

    def _between(self, placed: FloatArray, s: int) -> FloatArray:
        """Return the pose that best maps points (N, m, 3) to the measurements from station s."""
        own = (self.station == s)[:, None] & self._placed._seen
        apart = placed[own] - placed[own].mean(0) if own.any() else np.zeros((1, 3))
        if np.linalg.svd(apart, compute_uv=False)[1:2].sum() < _LINE:
            raise InputValueError(
                f"identify: station {s + 1}: the frame of a station requires three or more "
                f"measured targets that are not collinear; got {own.sum()} targets"
            )
        return transformation(placed[own], self.points[own])
