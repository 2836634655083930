"""Measurements from a table whose header states the units.

    q1 [deg], ..., q6 [deg], x [mm], y [mm], z [mm]                       one target
    q1 [deg], ..., q6 [deg], x1 [mm], y1 [mm], z1 [mm], x2 [mm], ...      several targets
    q1 [deg], ..., q6 [deg], target, x [mm], y [mm], z [mm]               a row a target
    station, q1 [deg], ..., q6 [deg], x [mm], y [mm], z [mm]              several stations
    q1 [deg], ..., q6 [deg], x [mm], y [mm], z [mm], rx [deg], ry [deg], rz [deg]
    q1 [deg], ..., q6 [deg], x [mm], y [mm], z [mm], qw, qx, qy, qz

Commas, semicolons, tabs or, where no heading has one, spaces separate the columns, which stand in
any order. Coordinates are called by
the robot's names, or q, theta, joint, axis, j or a and a number; coordinates of several targets x1,
x_1, p1_x, target_1_x and so on. A unit stands in brackets, or behind an underscore or a space:
"q1 [deg]", "q1_deg", "theta1 (deg)", "x mm"; or in a row of units below the header. Where no angle
has a unit, or no position, numbers that are far too large for radians are degrees, and those too
large for metres millimetres. The fifth form gives poses by rotation vectors, or by
`roll`, `pitch` and `yaw`; the sixth by quaternions. A column of stations goes with all forms of
positions. Empty cells of a position mean that the target
was not seen. Blank lines, and lines that start with "#" or "%", are left out; so are other columns.
With semicolons or tabs a decimal may be a comma.
"""

from __future__ import annotations

import codecs
import csv
import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ... import screws
from ...errors import InputValueError
from .observations import Observation, Poses, Positions
from .quaternions import rotations
from .stations import Stations

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]

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
_WORDS = {
    "grad": "deg",  # in a German header
    "degree": "deg",
    "degrees": "deg",
    "radian": "rad",
    "radians": "rad",
    "meter": "m",
    "metre": "m",
    "meters": "m",
    "metres": "m",
    "millimeter": "mm",
    "millimetre": "mm",
    "millimeters": "mm",
    "millimetres": "mm",
}
"""Units as words."""
_AXES = ("x", "y", "z")
_TURNS = (("rx", "ry", "rz"), ("roll", "pitch", "yaw"))
_QUATERNION = ("qw", "qx", "qy", "qz")
_COMPONENT = re.compile(r"(?:q|quat|quaternion)[_ .]?([wxyz])")
_ROUNDED = 0.02
"""Difference of a quaternion's length, in parts of it, that two decimals leave."""
_HEADING = re.compile(r"\s*([^\[\](]+?)\s*(?:[\[(]\s*([^\])]+?)\s*[\])])?\s*")
_SUFFIX = re.compile(rf"(.+?)[_ ]({'|'.join(UNITS)})")
_JOINT = re.compile(
    r"(?:q|theta|joint|axis|achse|gelenk|j|a)[_ ]?(\d+)(?:[_ .](?:pos|position|angle|act|actual))?"
)
_TURN = 2 * math.pi
"""Largest joint angle [rad]: larger numbers without a unit are degrees."""
_HALL = 20.0
"""Largest distance [m] from a device: larger numbers without a unit are millimetres."""
_TARGET = (
    re.compile(r"([xyz])[_ ]?(\d+)"),
    re.compile(r"(?:target|point|marker|smr|p|t|m)[_ ]?(\d+)[_ .]?([xyz])"),
)
_POSITION = re.compile(r"[xyz]\d*")
_WHICH = ("target", "marker", "point", "smr", "ball")
_COMMENT = ("#", "%")
_STATION = "station"
"""The column that names the place of the device."""
_UNSEEN = ("", "nan", "-", "--", "n/a", "na", "none", "null")
"""What a cell says, in small letters, of a target that was not seen."""


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
    text = _decoded(path.read_bytes())
    lines = [
        (number, line)
        for number, line in enumerate(text.splitlines(), 1)
        if line.strip(" \t,;") and not line.lstrip().startswith(_COMMENT)
    ]
    if not lines:
        raise InputValueError(f"{path}: empty; expected a header and a row for each measurement")
    separator = next((mark for mark in ";\t," if mark in lines[0][1]), "")
    cells = _cells([line for _, line in lines], separator)
    _check_header(path, cells[0])
    rows = [(number, line) for (number, _), line in zip(lines[1:], cells[1:], strict=True)]
    if rows and _is_units(rows[0][1]):
        paired = zip(cells[0], rows.pop(0)[1], strict=False)
        cells[0] = [f"{name} [{_bare(unit)}]" if unit.strip() else name for name, unit in paired]
    if not rows:
        raise InputValueError(f"{path}: a header and no rows; expected one for each measurement")
    decimal = "," if separator in ("", ";", "\t") else "."
    table = _with_units(_Table(path, _columns(path, cells[0], robot), rows, decimal), robot)
    q = np.stack([table.numbers(*_column_of(table, robot, k)) for k in range(robot.n)], -1)
    for number, line in rows:
        _check_length(path, number, line, len(cells[0]))
    return _observation(table, q)


def _cells(lines: Sequence[str], separator: str) -> list[list[str]]:
    """The cells of each line; spaces separate them where all lines have equally many."""
    words = [line.split() for line in lines]
    if not separator and len(words[0]) > 1 and len({len(cells) for cells in words}) == 1:
        return words
    return list(csv.reader(lines, delimiter=separator or ",", skipinitialspace=True))


def _bare(unit: str) -> str:
    """A unit without its brackets."""
    return unit.strip().strip("[]()").strip()


def _is_units(line: Sequence[str]) -> bool:
    """Whether a line holds units and nothing else."""
    words = [_bare(cell).lower() for cell in line if cell.strip()]
    return any(word in UNITS for word in words) and all(
        word in (*UNITS, *_WORDS, "-", "1") for word in words
    )


def _decoded(content: bytes) -> str:
    """Text in UTF-8, or as Windows programs write it: UTF-16 with a mark, or code page 1252."""
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return content.decode("utf-16")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("cp1252", errors="replace")


def _check_header(path: Path, header: Sequence[str]) -> None:
    if len(header) == 1:
        raise InputValueError(
            f"{path}: the header has one column, {header[0].strip()!r}; expected columns that are "
            "separated by commas, semicolons or tabs"
        )
    if all(_is_number(cell) for cell in header if cell.strip()):
        raise InputValueError(
            f"{path}: the first line holds numbers; expected a header such as "
            "'q1 [deg], ..., x [mm], y [mm], z [mm]'"
        )


def _check_length(path: Path, number: int, line: Sequence[str], columns: int) -> None:
    if any(cell.strip() for cell in line[columns:]):
        raise InputValueError(
            f"{path}, line {number}: {len(line)} cells and {columns} columns in the header; "
            "where a comma is the decimal mark, separate columns by semicolons or tabs"
        )


def _is_number(cell: str) -> bool:
    try:
        float(cell.replace(",", "."))
    except ValueError:
        return False
    return True


class _Column(NamedTuple):
    heading: str
    number: int
    unit: str


class _Table(NamedTuple):
    path: Path
    columns: Mapping[str, _Column]
    rows: Sequence[tuple[int, Sequence[str]]]
    decimal: str

    def numbers(self, name: str, kind: str, *, may_be_empty: bool = False) -> FloatArray:
        """A column in metres, radians or, of kind "1", as it stands."""
        column = self.columns[name]
        factor = self._factor(column.heading, column.unit, kind)
        values = [self._number(name, number, line, may_be_empty) for number, line in self.rows]
        return np.array(values) * factor

    def positions(self, names: Sequence[str]) -> FloatArray:
        """(rows, 3) positions in metres; NaN where all three cells of a target are empty."""
        points = np.stack([self.numbers(name, "m", may_be_empty=True) for name in names], -1)
        unseen = np.isnan(points)
        for k in np.flatnonzero(unseen.any(1) & ~unseen.all(1)).tolist():
            column = self.columns[names[int(np.argmax(unseen[k]))]]
            raise InputValueError(
                f"{self.path}, line {self.rows[k][0]}: {column.heading!r} is empty; expected a "
                "number, or no coordinate of a target that was not seen"
            )
        return points

    def _factor(self, name: str, unit: str, kind: str) -> float:
        if kind == "1":
            return 1.0
        expected = [word for word, (of, _) in UNITS.items() if of == kind]
        found = f"unit {unit!r}" if unit else "no unit"
        unit = _WORDS.get(unit.lower(), unit.lower())
        if unit not in expected:
            raise InputValueError(
                f"{self.path}: column {name!r} has {found}; expected '{name} [{expected[0]}]' or "
                f"another of {', '.join(expected)}"
            )
        return UNITS[unit][1]

    def _number(self, name: str, number: int, line: Sequence[str], may_be_empty: bool) -> float:
        column = self.columns[name]
        text = line[column.number].strip() if column.number < len(line) else ""
        if may_be_empty and text.lower() in _UNSEEN:
            return math.nan
        try:
            value = float(text.replace(self.decimal, "."))
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise InputValueError(
                f"{self.path}, line {number}: {column.heading!r} is {text!r}, expected a number"
            )
        return value


def _columns(path: Path, header: Sequence[str], robot: Any) -> dict[str, _Column]:
    """The columns by the names that the module's text gives them."""
    columns: dict[str, _Column] = {}
    own = {coordinate.name for coordinate in robot.coordinates}
    for index, cell in enumerate(header):
        matched = _HEADING.fullmatch(cell)
        if matched is None:
            continue
        heading, unit = matched[1], matched[2] or ""
        if not unit and heading not in own and (suffixed := _SUFFIX.fullmatch(heading)):
            heading, unit = suffixed[1].strip(), suffixed[2]
        name = heading if heading in own else _plain(heading)
        if name in columns:
            raise InputValueError(f"{path}: two columns are called {heading!r}")
        columns[name] = _Column(heading, index, unit)
    return columns


def _plain(heading: str) -> str:
    """A heading as the module's text writes it: q1, x, x1, target."""
    small = heading.lower()
    if joint := _JOINT.fullmatch(small):
        return f"q{int(joint[1])}"
    if component := _COMPONENT.fullmatch(small):
        return f"q{component[1]}"
    if target := _TARGET[0].fullmatch(small):
        return f"{target[1]}{int(target[2])}"
    if target := _TARGET[1].fullmatch(small):
        return f"{target[2]}{int(target[1])}"
    return "target" if small in _WHICH else small


def _with_units(table: _Table, robot: Any) -> _Table:
    """The table, with units of angles or of positions that no column of their kind states."""
    turning = [k for k in range(robot.n) if robot.coordinates[k].unit == "rad"]
    angles = [name for k in turning if (name := _name_of(table, robot, k))]
    places = [name for name in table.columns if _POSITION.fullmatch(name)]
    found = dict(table.columns)
    for names, most, unit in ((angles, _TURN, "deg"), (places, _HALL, "mm")):
        if any(found[name].unit for name in names):
            continue
        largest = max((abs(v) for name in names for v in _plain_numbers(table, name)), default=0.0)
        if largest > most:
            found |= {name: found[name]._replace(unit=unit) for name in names}
    return table._replace(columns=found)


def _plain_numbers(table: _Table, name: str) -> FloatArray:
    """The numbers of a column as they stand; cells that are none are left out."""
    column = table.columns[name].number
    cells = (line[column] for _, line in table.rows if column < len(line))
    values = (cell.strip().replace(table.decimal, ".") for cell in cells)
    return np.array([float(value) for value in values if _is_finite(value)])


def _is_finite(cell: str) -> bool:
    return _is_number(cell) and math.isfinite(float(cell))


def _name_of(table: _Table, robot: Any, k: int) -> str:
    """The name of the column of a coordinate; "" where there is none."""
    first = 0 if "q0" in table.columns else 1
    names = (robot.coordinates[k].name, f"q{k + first}")
    return next((name for name in names if name in table.columns), "")


def _column_of(table: _Table, robot: Any, k: int) -> tuple[str, str]:
    coordinate = robot.coordinates[k]
    if name := _name_of(table, robot, k):
        return name, coordinate.unit
    raise InputValueError(
        f"{table.path}: no column for coordinate {coordinate.name!r}; expected "
        f"'{coordinate.name} [{'deg' if coordinate.unit == 'rad' else 'mm'}]' or 'q{k + 1} [...]'; "
        f"found {_headings(table)}"
    )


def _headings(table: _Table) -> str:
    return ", ".join(column.heading for column in table.columns.values())


def _observation(table: _Table, q: FloatArray) -> Measured:
    if "target" in table.columns and set(_AXES) <= table.columns.keys():
        return _long(table, q)
    several = [
        names
        for j in range(len(table.columns) + 1)
        if set(names := tuple(f"{axis}{j}" for axis in _AXES)) <= table.columns.keys()
    ]
    if not several and set(_AXES) <= table.columns.keys():
        several = [_AXES]
    if not several:
        raise InputValueError(
            f"{table.path}: no positions; expected columns x, y, z, or x1, y1, z1, x2 ...; found "
            f"{_headings(table)}"
        )
    points = np.stack(
        [table.positions(names) for names in several],
        1,
    )
    turned = _orientations(table)
    if turned is None:
        return Measured(q, _of_stations(points, _stations(table)))
    if np.any(_stations(table)):
        raise InputValueError(f"{table.path}: poses from several stations; expected positions")
    T = np.zeros((len(q), 4, 4))
    T[:, :3, :3], T[:, :3, 3], T[:, 3, 3] = turned, points[:, 0], 1
    return Measured(q, Poses(T))


def _of_stations(points: FloatArray, station: IntArray) -> Observation:
    return Stations(points, station) if np.any(station) else Positions(points)


def _stations(table: _Table) -> IntArray:
    """The number of each row's station, from 0 in the order of their first rows."""
    if _STATION not in table.columns:
        return np.zeros(len(table.rows), dtype=np.intp)
    index = table.columns[_STATION].number
    names = [line[index].strip() for _, line in table.rows]
    numbers = {name: k for k, name in enumerate(dict.fromkeys(names))}
    return np.array([numbers[name] for name in names], dtype=np.intp)


def _orientations(table: _Table) -> FloatArray | None:
    if set(_QUATERNION) <= table.columns.keys():
        return rotations(_quaternions(table))
    for names in _TURNS:
        if set(names) <= table.columns.keys():
            turns = np.stack([table.numbers(name, "rad") for name in names], -1)
            if names[0] == "rx":
                return screws.exp_rotation(turns)
            about = [screws.exp_rotation(turns[:, [k]] * np.eye(3)[k]) for k in range(3)]
            return np.asarray(about[2] @ about[1] @ about[0])
    return None


def _quaternions(table: _Table) -> FloatArray:
    """(rows, 4) the quaternions w, x, y, z, all of one length."""
    found = np.stack([table.numbers(name, "1") for name in _QUATERNION], -1)
    size = np.linalg.norm(found, axis=-1)
    usual = float(np.median(size))
    k = int(np.argmax(np.abs(size - usual)))
    if not abs(size[k] - usual) < _ROUNDED * usual:
        raise InputValueError(
            f"{table.path}, line {table.rows[k][0]}: the quaternion has the length {size[k]:.3g}, "
            f"and others have {usual:.3g}; are other columns called qw, qx, qy and qz?"
        )
    return found


def _long(table: _Table, q: FloatArray) -> Measured:
    """A row a target, in any order: equal coordinates are one configuration.

    A target that comes again at the same coordinates belongs to a further configuration.
    """
    index = table.columns["target"].number
    names = [line[index].strip() for _, line in table.rows]
    targets = list(dict.fromkeys(names))
    xyz = table.positions(_AXES)
    station = _stations(table)
    times: Counter[tuple[bytes, str]] = Counter()
    found: dict[tuple[bytes, int], int] = {}
    rows, first = [], []
    for k, name in enumerate(names):
        at = q[k].tobytes() + station[k].tobytes()
        key = at, times[at, name]
        times[at, name] += 1
        if key not in found:
            found[key] = len(found)
            first.append(k)
        rows.append(found[key])
    points = np.full((len(found), len(targets), 3), np.nan)
    points[rows, [targets.index(name) for name in names]] = xyz
    return Measured(q[first], _of_stations(points, station[first]))
