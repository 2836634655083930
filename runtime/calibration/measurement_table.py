"""Measurements from a table of comma-separated values whose header states the units.

    q1 [deg], ..., q6 [deg], x [mm], y [mm], z [mm]                       one target
    q1 [deg], ..., q6 [deg], x1 [mm], y1 [mm], z1 [mm], x2 [mm], ...      several targets
    q1 [deg], ..., q6 [deg], target, x [mm], y [mm], z [mm]               a row a target
    q1 [deg], ..., q6 [deg], x [mm], y [mm], z [mm], rx [deg], ry [deg], rz [deg]
    q1 [deg], ..., q6 [deg], x [mm], y [mm], z [mm], qw, qx, qy, qz

Coordinates are called by the robot's names or q1, q2 and so on. The fourth form gives poses by
rotation vectors, or by `roll`, `pitch` and `yaw`; the fifth by quaternions. Empty cells of a
position mean that the target was not seen. Other columns are left out.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import screws
from ..errors import InputValueError
from .observations import Observation, Poses, Positions

FloatArray = NDArray[np.float64]

UNITS = {
    "m": ("m", 1.0),
    "mm": ("m", 1e-3),
    "cm": ("m", 1e-2),
    "um": ("m", 1e-6),
    "inch": ("m", 0.0254),
    "rad": ("rad", 1.0),
    "mrad": ("rad", 1e-3),
    "deg": ("rad", math.pi / 180),
    "°": ("rad", math.pi / 180),
}
_AXES = ("x", "y", "z")
_TURNS = (("rx", "ry", "rz"), ("roll", "pitch", "yaw"))
_QUATERNION = ("qw", "qx", "qy", "qz")
_HEADING = re.compile(r"\s*([^\[\](]+?)\s*(?:[\[(]\s*([^\])]+?)\s*[\])])?\s*")


class Measured(NamedTuple):
    """Coordinates and what was measured there.

    Attributes:
        q: (N, n) [rad or m].
        observation: Positions of targets, or poses.
    """

    q: FloatArray
    observation: Observation


def read_measurements(file: str | Path, robot: Any) -> Measured:
    """Reads a table of measurements.

    Args:
        file: The table; its first line is the header.
        robot: The robot that was measured.

    Raises:
        InputValueError: A column is missing, a unit is missing or of the wrong kind, or a cell is
            no number; the message names file, line and column.
    """
    path = Path(file)
    with path.open(newline="", encoding="utf-8-sig") as stream:
        text = stream.read()
    separator = ";" if text.partition("\n")[0].count(";") else ","
    lines = list(csv.reader(text.splitlines(), delimiter=separator))
    if not lines:
        raise InputValueError(f"{path}: empty; expected a header and a row for each measurement")
    rows = [(number, line) for number, line in enumerate(lines[1:], 2) if any(map(str.strip, line))]
    table = _Table(path, _columns(path, lines[0]), rows)
    q = np.stack([table.numbers(*_column_of(table, robot, k)) for k in range(robot.n)], -1)
    return _observation(table, q)


class _Column(NamedTuple):
    number: int
    unit: str


class _Table(NamedTuple):
    path: Path
    columns: Mapping[str, _Column]
    rows: Sequence[tuple[int, Sequence[str]]]

    def numbers(self, name: str, kind: str, *, may_be_empty: bool = False) -> FloatArray:
        """A column in metres, radians or, of kind "1", as it stands."""
        column = self.columns[name]
        factor = self._factor(name, column.unit, kind)
        values = [self._number(name, number, line, may_be_empty) for number, line in self.rows]
        return np.array(values) * factor

    def _factor(self, name: str, unit: str, kind: str) -> float:
        if kind == "1":
            return 1.0
        expected = [word for word, (of, _) in UNITS.items() if of == kind]
        if unit not in expected:
            found = f"unit {unit!r}" if unit else "no unit"
            raise InputValueError(
                f"{self.path}: column {name!r} has {found}; expected '{name} [{expected[0]}]' or "
                f"another of {', '.join(expected)}"
            )
        return UNITS[unit][1]

    def _number(self, name: str, number: int, line: Sequence[str], may_be_empty: bool) -> float:
        index = self.columns[name].number
        text = line[index].strip() if index < len(line) else ""
        if not text and may_be_empty:
            return math.nan
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value) and not (may_be_empty and text.lower() == "nan"):
            raise InputValueError(
                f"{self.path}, line {number}: {name!r} is {text!r}, expected a number"
            )
        return value


def _columns(path: Path, header: Sequence[str]) -> dict[str, _Column]:
    columns: dict[str, _Column] = {}
    for index, cell in enumerate(header):
        matched = _HEADING.fullmatch(cell)
        if matched is None:
            continue
        name, unit = matched[1], matched[2] or ""
        if name in columns:
            raise InputValueError(f"{path}: two columns are called {name!r}")
        columns[name] = _Column(index, unit)
    return columns


def _column_of(table: _Table, robot: Any, k: int) -> tuple[str, str]:
    coordinate = robot.coordinates[k]
    for name in (coordinate.name, f"q{k + 1}"):
        if name in table.columns:
            return name, coordinate.unit
    raise InputValueError(
        f"{table.path}: no column for coordinate {coordinate.name!r}; expected "
        f"'{coordinate.name} [{'deg' if coordinate.unit == 'rad' else 'mm'}]' or 'q{k + 1} [...]'; "
        f"found {', '.join(table.columns)}"
    )


def _observation(table: _Table, q: FloatArray) -> Measured:
    if "target" in table.columns and set(_AXES) <= table.columns.keys():
        return _long(table, q)
    several = [
        names
        for j in range(1, len(table.columns))
        if set(names := tuple(f"{axis}{j}" for axis in _AXES)) <= table.columns.keys()
    ]
    if not several and set(_AXES) <= table.columns.keys():
        several = [_AXES]
    if not several:
        raise InputValueError(
            f"{table.path}: no positions; expected columns x, y, z, or x1, y1, z1, x2 ...; found "
            f"{', '.join(table.columns)}"
        )
    points = np.stack(
        [
            np.stack([table.numbers(name, "m", may_be_empty=True) for name in names], -1)
            for names in several
        ],
        1,
    )
    turned = _orientations(table)
    if turned is None:
        return Measured(q, Positions(points))
    T = np.zeros((len(q), 4, 4))
    T[:, :3, :3], T[:, :3, 3], T[:, 3, 3] = turned, points[:, 0], 1
    return Measured(q, Poses(T))


def _orientations(table: _Table) -> FloatArray | None:
    if set(_QUATERNION) <= table.columns.keys():
        w, x, y, z = (table.numbers(name, "1") for name in _QUATERNION)
        size = np.sqrt(w * w + x * x + y * y + z * z)
        vector = np.stack([x, y, z], -1) / size[:, None]
        angle = 2 * np.arctan2(np.linalg.norm(vector, axis=-1), w / size)
        return screws.exp_rotation(vector * _over(angle, np.linalg.norm(vector, axis=-1))[:, None])
    for names in _TURNS:
        if set(names) <= table.columns.keys():
            turns = np.stack([table.numbers(name, "rad") for name in names], -1)
            if names[0] == "rx":
                return screws.exp_rotation(turns)
            about = [screws.exp_rotation(turns[:, [k]] * np.eye(3)[k]) for k in range(3)]
            return np.asarray(about[2] @ about[1] @ about[0])
    return None


def _over(angle: FloatArray, sine: FloatArray) -> FloatArray:
    """Angle over the sine of its half; 2 where both are 0."""
    return np.divide(angle, sine, out=np.full_like(angle, 2.0), where=sine > 0)


def _long(table: _Table, q: FloatArray) -> Measured:
    """A row a target: rows of equal coordinates that follow each other are one configuration."""
    index = table.columns["target"].number
    names = [line[index].strip() for _, line in table.rows]
    targets = list(dict.fromkeys(names))
    xyz = np.stack([table.numbers(name, "m", may_be_empty=True) for name in _AXES], -1)
    new = np.concatenate([[True], (q[1:] != q[:-1]).any(-1)])
    configuration = np.cumsum(new) - 1
    points = np.full((int(new.sum()), len(targets), 3), np.nan)
    points[configuration, [targets.index(name) for name in names]] = xyz
    return Measured(q[new], Positions(points))
