"""Trajectories: coordinates, rates and accelerations of a robot over time."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chasles import InputValueError, Robot, ShapeError
from chasles.contract import check_type, read_input
from chasles.summaries import summary_repr

from ..arguments import real
from ..results import StudyResult, by_suffix, read_npz, write_table

FloatArray = NDArray[np.float64]

_STEP = 0.05
"""Default time step between table rows [s]."""
_SHOWN = 40
"""Maximum number of characters of a table cell that an error message shows."""
_NUMBERS = ("t", "q", "qd", "qdd")
_TIME = ("t [s]", "t", "time [s]", "time")
"""Supported names of the time column in a .csv file."""


@dataclass(frozen=True, eq=False)
class Trajectory(StudyResult):
    """A motion of a robot, sampled in time.

    Attributes:
        robot: Name of the robot.
        coordinate_names: Names of the coordinates.
        t: (m,) times [s].
        q: (m, n) coordinates [rad or m].
        qd: (m, n) rates [rad/s or m/s].
        qdd: (m, n) accelerations [rad/s^2 or m/s^2].
        T: (m, 4, 4) tool poses in the base frame, with positions in [m].
        V: (m, 6) velocity of the tool origin [m/s] and angular velocity of the tool [rad/s], in the
            axes of the base frame.
        stage: (m,) index of each sample's stage in a sequence of motions, or 0 for a single motion.
    """

    robot: str
    coordinate_names: tuple[str, ...]
    t: FloatArray
    q: FloatArray
    qd: FloatArray
    qdd: FloatArray
    T: FloatArray
    V: FloatArray
    stage: NDArray[np.intp]

    def __repr__(self) -> str:
        """Short summary with the main values."""
        stages = f"{self.stage[-1] + 1} stages" if self.stage[-1] else ""
        return summary_repr(
            self,
            self.robot,
            f"{len(self.t):,} times from {self.t[0]:.6g} to {self.t[-1]:.6g} s",
            stages,
            f"maximum rate {np.abs(self.qd).max():.4g}, acceleration {np.abs(self.qdd).max():.4g}",
            methods="t, q, qd, qdd, T, V, q_at(t), plot(), save(path)",
        )

    def q_at(self, t: ArrayLike) -> FloatArray:
        """Return coordinates (..., n) at times t (...) [s], by linear interpolation.

        Times before the start of the trajectory give its first sample, and times after its end give
        its last sample.
        """
        times = real("Trajectory.q_at: t", t)
        columns = [np.interp(times, self.t, column) for column in self.q.T]
        return np.asarray(np.stack(columns, axis=-1))

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Write a table with one row per sample.

        The columns contain times, coordinates, rates, accelerations and tool positions.
        """
        names = self.coordinate_names
        head = [_TIME[0], *names, *_rates(names), *_accelerations(names), "x [m]", "y [m]", "z [m]"]
        rows = np.column_stack([self.t, self.q, self.qd, self.qdd, self.T[:, :3, 3]])
        write_table(path, head, rows.tolist())

    def plot(self, ax: Any = None) -> Any:
        """Plot coordinates, rates and accelerations over time.

        Args:
            ax: Three matplotlib axes, or None for a new figure.

        Returns:
            The three axes.
        """
        from ..pictures import plot_trajectory  # noqa: PLC0415

        return plot_trajectory(self, ax)

    @classmethod
    def load(cls, path: str | os.PathLike[str], robot: Robot | None = None) -> Self:
        """Return a trajectory from a file.

        Args:
            path: A .npz file that `to_npz` wrote, a .npz file with arrays `t (m,)` and `q (m, n)`,
                or a .csv file with a header. The .csv columns are the coordinate names [rad or m],
                and optionally "t [s]", "NAME rate" and "NAME acceleration". All other columns of a
                .csv file are ignored. If the file contains no times, the time step is 0.05 s.
                Missing rates and accelerations are computed by finite differences.
            robot: The robot of the trajectory, required unless `to_npz` wrote the file.

        Raises:
            InputValueError: The file cannot be read or belongs to a different robot, a column is
                missing, a cell is not a number, or times are not ascending. InputValueError is also
                raised if the file needs `robot`, but `robot` is None.
            ShapeError: The shapes of the arrays do not match the robot.
        """
        if by_suffix(path, {".npz": True, ".csv": False}):
            arrays = read_npz(path)
            if "facts" in arrays:
                made = super().load(path)
                _require_robot(path, made, robot)
                return made
        elif robot is not None:
            arrays = _table(Path(path), robot)
        if robot is None:
            raise InputValueError(f"{path}: robot= is required to compute the tool poses")
        return cls._of(path, robot, arrays)

    @classmethod
    def _of(cls, path: Any, robot: Robot, arrays: dict[str, Any]) -> Self:
        """Return the trajectory of a robot from the arrays t and q, and optionally qd and qdd."""
        if "t" not in arrays or "q" not in arrays:
            raise InputValueError(f"{path}: expected arrays t and q, got {', '.join(arrays)}")
        arrays = {name: _real(path, name, arrays[name]) for name in _NUMBERS if name in arrays}
        t, q = arrays["t"], arrays["q"]
        if t.ndim != 1 or q.shape != (shape := (len(t), robot.n)):
            raise ShapeError(
                f"{path}: expected t (m,) and q (m, {robot.n}) of {robot.name}, got {t.shape} and "
                f"{q.shape}"
            )
        for name in {"qd", "qdd"} & arrays.keys():
            if arrays[name].shape != shape:
                raise ShapeError(f"{path}: expected array {name} {shape}, got {arrays[name].shape}")
        if not len(t):
            raise InputValueError(f"{path}: expected at least one row of coordinates")
        if not all(np.isfinite(array).all() for array in arrays.values()):
            raise InputValueError(f"{path}: expected finite times and coordinates")
        if not (np.diff(t) > 0).all():
            raise InputValueError(f"{path}: expected ascending times")
        qd = arrays.get("qd", _slopes(t, q))
        qdd = arrays.get("qdd", _slopes(t, qd))
        stage = np.zeros(len(t), dtype=np.intp)
        return cls(
            robot.name, _names(robot), t, q, qd, qdd, robot.fk(q), robot.twist_mixed(q, qd), stage
        )


def concatenate(trajectories: Sequence[Trajectory]) -> Trajectory:
    """Concatenate trajectories of one robot.

    Args:
        trajectories: The trajectories in order. Times are shifted, so that each trajectory starts
            at the end time of the previous one, and the first at 0.

    Returns:
        The trajectory. `stage` (m,) is the index of the trajectory from which each sample comes.
        The first sample of a trajectory replaces the last sample of the previous one.

    Raises:
        InputTypeError: `trajectories` is not a list or tuple of `Trajectory` objects.
        InputValueError: `trajectories` is empty, or the trajectories belong to different robots.
    """
    check_type("concatenate: trajectories", trajectories, Sequence)
    for index, own in enumerate(trajectories):
        check_type(f"concatenate: trajectories[{index}]", own, Trajectory)
    if not trajectories or len({own.robot for own in trajectories}) > 1:
        raise InputValueError("concatenate: expected one or more trajectories of the same robot")
    begin, parts = 0.0, []
    for index, own in enumerate(trajectories):
        kept = slice(None) if index == len(trajectories) - 1 else slice(0, -1)
        t = own.t - own.t[0] + begin
        begin = float(t[-1])
        arrays = (t, own.q, own.qd, own.qdd, own.T, own.V, np.full(len(t), index))
        parts.append([array[kept] for array in arrays])
    columns = [np.concatenate(column) for column in zip(*parts, strict=True)]
    first = trajectories[0]
    return Trajectory(first.robot, first.coordinate_names, *columns)


def _names(robot: Robot) -> tuple[str, ...]:
    return tuple(coordinate.name for coordinate in robot.coordinates)


def _rates(names: Sequence[str]) -> list[str]:
    return [f"{name} rate" for name in names]


def _accelerations(names: Sequence[str]) -> list[str]:
    return [f"{name} acceleration" for name in names]


def _real(path: Any, name: str, values: Any) -> FloatArray:
    """Return an array of a trajectory file as float64."""
    if values.dtype.kind not in "iuf":
        raise InputValueError(f"{path}: expected real numbers in array {name}, got {values.dtype}")
    return np.asarray(values, dtype=np.float64)


def _slopes(t: FloatArray, values: FloatArray) -> FloatArray:
    """Return time derivatives (m, n) from finite differences, or zeros for a single sample."""
    if len(t) == 1:
        return np.zeros(values.shape)
    return np.asarray(np.gradient(values, t, axis=0))


def _require_robot(path: Any, made: Trajectory, robot: Robot | None) -> None:
    if robot is None or (made.robot, made.coordinate_names) == (robot.name, _names(robot)):
        return
    raise InputValueError(
        f"{path}: expected robot {robot.name} ({', '.join(_names(robot))}), got robot "
        f"{made.robot} ({', '.join(made.coordinate_names)})"
    )


def _table(path: Path, robot: Robot) -> dict[str, Any]:
    """Return the arrays t and q of a .csv file, and qd and qdd if the file contains them."""
    try:
        lines = io.StringIO(read_input(path).decode("utf-8-sig"), newline="")
        head, *rows = [row for row in csv.reader(lines) if row]
    except (OSError, ValueError, csv.Error) as error:
        raise InputValueError(f"{path}: expected a table with a header ({error})") from None
    header, names = [name.strip() for name in head], _names(robot)
    missing = [name for name in names if name not in header]
    if len(missing) == len(names) and all(map(_is_number, header)):
        raise InputValueError(
            f"{path}: the first line has numbers, not the names of columns; add the line "
            f"{','.join(names)}, or t,{','.join(names)} (with times)"
        )
    if missing:
        raise InputValueError(f"{path}: no column for {', '.join(missing)} of robot {robot.name}")

    def columns(wanted: Sequence[str]) -> FloatArray:
        return np.column_stack([_column(path, header, rows, name) for name in wanted])

    found = {"q": columns(names)}
    for key, wanted in (("qd", _rates(names)), ("qdd", _accelerations(names))):
        if set(wanted) <= set(header):
            found[key] = columns(wanted)
    time = [name for name in _TIME if name in header][:1]
    found["t"] = columns(time)[:, 0] if time else _STEP * np.arange(len(rows), dtype=np.float64)
    return found


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _column(path: Path, header: list[str], rows: list[list[str]], name: str) -> list[float]:
    k = header.index(name)
    values = []
    for line, row in enumerate(rows, 2):
        try:
            values.append(float(row[k]))
        except (ValueError, IndexError):
            got = repr(row[k][:_SHOWN]) if k < len(row) else "no entry"
            raise InputValueError(
                f"{path}, line {line}, {name}: expected a number, got {got}"
            ) from None
    return values
