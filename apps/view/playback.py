"""Paths and motions to be played: tables of coordinates, and files of sampled motions."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chasles import InputValueError, Robot

FloatArray = NDArray[np.float64]

_STEP = 0.05
"""Seconds between the rows of a table without times."""
_TIME = ("t", "t [s]", "time", "time [s]")
"""The names that a column of times may have."""


@dataclass(frozen=True, eq=False)
class Recording:
    """Coordinates over time.

    Attributes:
        t: (m,) times [s], from 0, never falling.
        q: (m, n) coordinates [rad or m].
    """

    t: FloatArray
    q: FloatArray

    def at(self, time: float) -> FloatArray:
        """(n,) coordinates at a time [s], linear between rows; at the ends beyond them."""
        return np.array([np.interp(time, self.t, column) for column in self.q.T])


def read_recording(file: Path, robot: Robot) -> Recording:
    """Reads a file of a `Trajectory`, or a table of coordinates.

    Args:
        file: `.npz` with arrays `t (m,)` and `q (m, n)`, and maybe `robot` and `names`, the names
            of the robot and of its coordinates; or a table `.csv` with a header: a column named
            after each coordinate [rad or m], and maybe one of times, "t [s]". Other columns are
            ignored. Without times, rows are 0.05 s apart.
        robot: The robot.

    Raises:
        InputValueError: The file cannot be read, is the recording of another robot, lacks a column,
            or holds what is no number; times fall.
    """
    t, q = _from_npz(file, robot) if file.suffix == ".npz" else _from_csv(file, robot)
    if len(q) == 0:
        raise InputValueError(f"{file}: expected at least one row of coordinates")
    if not (np.isfinite(q).all() and np.isfinite(t).all()):
        raise InputValueError(f"{file}: expected finite times and coordinates")
    if (np.diff(t) < 0).any():
        raise InputValueError(f"{file}: expected times that never fall")
    return Recording(t - t[0], q)


def _from_npz(file: Path, robot: Robot) -> tuple[FloatArray, FloatArray]:
    try:
        with np.load(file) as arrays:
            t, q = (np.asarray(arrays[name], dtype=np.float64) for name in "tq")
            told = {name: np.array(arrays[name]) for name in ("robot", "names") if name in arrays}
    except (OSError, KeyError, ValueError) as error:
        raise InputValueError(f"{file}: expected arrays t and q of numbers ({error})") from error
    _refuse_another(file, robot, told)
    if q.shape != (*t.shape, robot.n) or t.ndim != 1:
        raise InputValueError(
            f"{file}: expected t (m,) and q (m, {robot.n}) of {robot.name}, got {t.shape} and "
            f"{q.shape}"
        )
    return t, q


def _refuse_another(file: Path, robot: Robot, told: Mapping[str, NDArray[Any]]) -> None:
    """Raises InputValueError if a file names another robot, or other coordinates."""
    own = ", ".join(coordinate.name for coordinate in robot.coordinates)
    names = ", ".join(map(str, np.ravel(told["names"]))) if "names" in told else own
    name = str(told.get("robot", robot.name))
    if (name, names) != (robot.name, own):
        raise InputValueError(
            f"{file}: a recording of {name} ({names}), expected one of {robot.name} ({own}); a "
            ".csv goes by the names of its columns alone"
        )


def _from_csv(file: Path, robot: Robot) -> tuple[FloatArray, FloatArray]:
    try:
        with file.open(newline="", encoding="utf-8") as lines:
            head, *rows = [row for row in csv.reader(lines) if row]
    except (OSError, ValueError) as error:
        raise InputValueError(f"{file}: expected a table with a header ({error})") from error
    names = [name.strip() for name in head]
    missing = [c.name for c in robot.coordinates if c.name not in names]
    if missing:
        raise InputValueError(f"{file}: no column for {', '.join(missing)} of {robot.name}")
    q = np.column_stack([_column(file, names, rows, c.name) for c in robot.coordinates])
    time = next((name for name in _TIME if name in names), None)
    t = _column(file, names, rows, time) if time else _STEP * np.arange(len(q), dtype=np.float64)
    return t, q


def _column(file: Path, names: list[str], rows: list[list[str]], name: str) -> FloatArray:
    k = names.index(name)
    values = []
    for line, row in enumerate(rows, 2):
        try:
            values.append(float(row[k]))
        except (ValueError, IndexError):
            got = repr(row[k]) if k < len(row) else "no entry"
            raise InputValueError(
                f"{file}, line {line}, {name}: expected a number, got {got}"
            ) from None
    return np.array(values, dtype=np.float64)
