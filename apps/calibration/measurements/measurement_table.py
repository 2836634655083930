"""Read a table of joint coordinates and measured target positions or poses, in a common format.

Each row of the table contains joint angles, for example in the columns q1 [deg], ..., q6 [deg]. The
position of a single target is in the columns x [mm], y [mm], z [mm]. The positions of several
targets are in the columns x1 [mm], y1 [mm], z1 [mm], x2 [mm], ... If the table has a column
"target", each row contains the position of one target. A column "station" names the location of the
measuring device for each row. The orientation of a pose is in the columns rx [deg], ry [deg], rz
[deg], or qw, qx, qy, qz.

The columns of the table can be in any order. `headings.py` lists the supported headings.
`table_text.py` lists the supported column separators. The units of the columns are in the headings
or in a row below the header. If all joint angles, all orientation angles or all positions lack a
unit, their unit is inferred from their values. ``MeasurementTable.assumptions`` reports inferred
units. In a table without a header, the number of columns and their values determine the meaning of
each column (`bare_table.py`). Three empty position cells mean that a target was invisible. Table
columns with unknown headings are ignored.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chasles import InputValueError, Robot
from chasles.contract import as_path
from chasles.summaries import short_repr

from .bare_table import header_of
from .headings import AXES, STATION, TARGET, UNITS, Column, named, unit_of
from .stations import StationPositions
from .table_text import TableLine, cells_of, is_number, number
from .tool_measurements import Measurements, Poses, Positions
from .turns import Form, WrongRow, described, form_of, unit_by_size

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]

_HALL = 20.0
"""Maximum target coordinate in the frame of the measuring device [m]. If a target coordinate
without a unit exceeds 20, all positions are in millimeters."""
_TITLES = 30
"""Maximum number of table lines above the first line with numbers."""
_UNSEEN = ("", "nan", "-", "--", "n/a", "na", "none", "null")
"""Cell texts, in lower case, that mark an invisible target."""
_UNITLESS = ("-", "1")
"""Cell texts in the row of units, below the headings, that mark a column without a unit."""


@dataclass(frozen=True, eq=False)
class MeasurementTable:
    """Joint coordinates and measurements from a table.

    Attributes:
        q: (N, n) actuated coordinates [rad or m].
        measurements: The measured positions or poses, for the argument `measurements` of
            `identify`.
        assumptions: Facts inferred from the values in the table, one sentence each.
    """

    q: FloatArray
    measurements: Measurements
    assumptions: tuple[str, ...] = ()

    __repr__ = short_repr


def read_measurements(path: str | Path, robot: Robot) -> MeasurementTable:
    """Read joint coordinates and measured tool positions or poses from a text file.

    Args:
        path: A text file with one row per measurement, usually below a header. The columns are
            separated by commas, semicolons, tabs, bars or spaces. Typical columns are q1 [deg],
            ..., q6 [deg] for the coordinates, and x [mm], y [mm], z [mm] for the position of a
            target on the tool. Several targets have the columns x1 [mm], y1 [mm], z1 [mm], x2 [mm],
            and so on. A pose also has an orientation, such as a rotation vector rx [rad], ry [rad],
            rz [rad], or a quaternion qw, qx, qy, qz. If there is a column "target", each row
            contains one target. A column "station" contains the name of the location of the
            measuring device. Empty position cells mark an invisible target. Units are m, mm, cm, um
            or inch, and rad, mrad or deg. The reference page "Calibration tables" lists all
            headings, and the rules that infer missing units. Positions and poses are in the frame
            of the measuring device.
        robot: The measured robot. Its coordinates determine the names and units of the coordinate
            columns.

    Returns:
        A `MeasurementTable`. `q` (N, n) contains the actuated coordinates [rad or m].
        `measurements` is a `Positions`, `StationPositions` or `Poses` object, with positions in
        [m]. `assumptions` lists the facts that were inferred from the values, such as missing
        units. Pass `q` and `measurements` to `identify`.

    Raises:
        InputTypeError: `path` is neither text nor a path.
        InputValueError: The file cannot be read, is empty, or is a spreadsheet. A required column
            is missing, or two columns have the same name. A column has no unit, and its unit cannot
            be inferred. A column of lengths has an angle unit, or a column of angles has a length
            unit. A cell is not a number, an orientation is not a rotation, or a row has too many
            cells. The message states the file, and the line or column of the error.
    """
    table = _with_units(_read(as_path("path", path), robot), robot)
    q = np.stack([table.numbers(*_column_of(table, robot, k)) for k in range(robot.n)], -1)
    for row in table.rows:
        _check_length(table.path, row, table.width)
    return _observation(table, q)


def _read(path: Path, robot: Robot) -> _Table:
    """Return the table with named columns and the units stated in the file."""
    cells = cells_of(path)
    first = _first_row(path, cells.lines)
    titles, rows = cells.lines[:first], cells.lines[first:]
    units: list[str] = []
    if titles and _is_units(titles[-1].cells):
        units = titles.pop().cells
    said: list[str] = []
    if titles:
        header = titles.pop().cells
    elif len(cells.comment) == len(rows[0].cells):
        header = cells.comment
    else:
        header = header_of(path, rows, robot, said)
    if titles:
        said.append(f"lines {titles[0].number} to {titles[-1].number} are skipped as titles")
    found = named(header, [coordinate.name for coordinate in robot.coordinates])
    if found.repeated:
        raise InputValueError(f"{path}: two columns have the name {found.repeated[0]!r}")
    columns = {
        name: column._replace(unit=_unit(units, column)) for name, column in found.columns.items()
    }
    return _Table(path, columns, rows, [*said, *found.said], len(header))


def _first_row(path: Path, lines: Sequence[TableLine]) -> int:
    """Return the index of the first line with numbers."""
    if len(lines[0].cells) == 1 == len(lines[-1].cells):
        raise InputValueError(
            f"{path}: the header has only one column, {lines[0].cells[0].strip()!r}; expected "
            "columns separated by commas, semicolons or tabs"
        )
    for k, line in enumerate(lines[: _TITLES + 1]):
        filled = [cell for cell in line.cells if cell.strip()]
        if 2 * sum(map(is_number, filled)) > len(filled):
            return k
    raise InputValueError(
        f"{path}: the table has a header but no rows; expected a row for each measurement"
    )


def _is_units(line: Sequence[str]) -> bool:
    """Return whether a line contains only units."""
    words = [cell.strip() for cell in line if cell.strip()]
    return any(map(unit_of, words)) and all(unit_of(w) or w in _UNITLESS for w in words)


def _unit(units: Sequence[str], column: Column) -> str:
    """Return the unit from the row of units or from the heading."""
    return (unit_of(units[column.number]) if column.number < len(units) else "") or column.unit


def _check_length(path: Path, row: TableLine, columns: int) -> None:
    if any(cell.strip() for cell in row.cells[columns:]):
        raise InputValueError(
            f"{path}, line {row.number}: the line has more cells than the header: "
            f"{len(row.cells)} instead of {columns}; "
            "if commas are decimal marks, separate columns by semicolons or tabs"
        )


class _Table(NamedTuple):
    path: Path
    columns: Mapping[str, Column]
    rows: Sequence[TableLine]
    said: list[str]
    width: int

    def numbers(self, name: str, kind: str, *, may_be_empty: bool = False) -> FloatArray:
        """Return the numbers in a column, converted to meters or radians.

        A dimensionless column (kind "1") is not scaled.
        """
        factor = self._factor(self.columns[name], kind)
        return np.array([self._number(name, row, may_be_empty) for row in self.rows]) * factor

    def positions(self, names: Sequence[str]) -> FloatArray:
        """Return the target position in each row (rows, 3) [m], or NaN for three empty cells."""
        points = np.stack([self.numbers(name, "m", may_be_empty=True) for name in names], -1)
        unseen = np.isnan(points)
        for k in np.flatnonzero(unseen.any(1) & ~unseen.all(1)).tolist():
            column = self.columns[names[int(np.argmax(unseen[k]))]]
            raise InputValueError(
                f"{self.path}, line {self.rows[k].number}: {column.heading!r}: the cell is empty; "
                "expected a number, or three empty cells for an invisible target"
            )
        return points

    def plain(self, names: Sequence[str]) -> FloatArray:
        """Return the values (rows, k) of k columns without unit conversion.

        A row is omitted if one of its k cells contains no number.
        """
        columns = [self.columns[name].number for name in names]
        cells = [[_cell(row, column) for column in columns] for row in self.rows]
        found = np.array([[number(cell) for cell in row] for row in cells]).reshape(-1, len(names))
        return np.asarray(found[np.isfinite(found).all(-1)])

    def names_of_rows(self, name: str) -> list[str]:
        """Return the cells of a column, without spaces at either end."""
        return [_cell(row, self.columns[name].number) for row in self.rows]

    def _factor(self, column: Column, kind: str) -> float:
        if kind == "1":
            return 1.0
        expected = [word for word, (of, _) in UNITS.items() if of == kind]
        if column.unit not in expected:
            found = f"unit {column.unit!r}" if column.unit else "no unit"
            raise InputValueError(
                f"{self.path}: column {column.heading!r} has {found}; expected one of the units "
                f"{', '.join(expected)}, as in '{column.heading} [{expected[0]}]'"
            )
        return UNITS[column.unit][1]

    def _number(self, name: str, row: TableLine, may_be_empty: bool) -> float:
        column = self.columns[name]
        text = _cell(row, column.number)
        if may_be_empty and text.lower() in _UNSEEN:
            return math.nan
        if not math.isfinite(value := number(text)):
            raise InputValueError(
                f"{self.path}, line {row.number}: {column.heading!r}: expected a number, "
                f"got {text!r}"
            )
        return value


def _cell(row: TableLine, column: int) -> str:
    return row.cells[column].strip() if column < len(row.cells) else ""


def _with_units(table: _Table, robot: Robot) -> _Table:
    """Return the table, with inferred units of angles and positions if the file states no units."""
    turning = [k for k in range(robot.n) if robot.coordinates[k].unit == "rad"]
    form = form_of(table.columns)
    turns = [name for k in turning if (name := _name_of(table, robot, k))]
    angles = form.names if form and form.kind == "rad" else ()
    places = [name for name in table.columns if name[:1] in AXES and (name[1:] or "0").isdecimal()]
    found = dict(table.columns)
    for words, names, of in (
        ("joint angles", turns, unit_by_size),
        ("angles of orientations", angles, unit_by_size),
        ("positions", places, _length_by_size),
    ):
        if not names or any(found[name].unit for name in names):
            continue
        if unit := of(table.plain(names)):
            found |= {name: found[name]._replace(unit=unit) for name in names}
            table.said.append(f"{words} have no unit; their values suggest {unit}")
    return table._replace(columns=found)


def _length_by_size(values: FloatArray) -> str:
    return "mm" if np.abs(values).max(initial=0.0) > _HALL else ""


def _name_of(table: _Table, robot: Robot, k: int) -> str:
    """Return the column name of robot coordinate k, or "" if the table has no such column."""
    first = 0 if "q0" in table.columns else 1
    names = (robot.coordinates[k].name, f"q{k + first}")
    return next((name for name in names if name in table.columns), "")


def _column_of(table: _Table, robot: Robot, k: int) -> tuple[str, str]:
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


def _observation(table: _Table, q: FloatArray) -> MeasurementTable:
    if TARGET in table.columns and set(AXES) <= table.columns.keys():
        return _long(table, q)
    numbers = range(len(table.columns) + 1)
    several = [names for j in numbers if _has(table, names := tuple(f"{a}{j}" for a in AXES))]
    if not several and _has(table, AXES):
        several = [AXES]
    if not several:
        raise InputValueError(
            f"{table.path}: no positions; expected columns x, y, z, or x1, y1, z1, x2 ...; found "
            f"{_headings(table)}"
        )
    points = np.stack([table.positions(names) for names in several], 1)
    form = form_of(table.columns)
    if form is None:
        return MeasurementTable(q, _of_stations(points, _stations(table)), tuple(table.said))
    if np.any(_stations(table)):
        raise InputValueError(
            f"{table.path}: the table has poses from several stations; expected positions"
        )
    T = np.zeros((len(q), 4, 4))
    T[:, :3, :3], T[:, :3, 3], T[:, 3, 3] = _orientations(table, form), points[:, 0], 1
    return MeasurementTable(q, Poses(T), tuple(table.said))


def _has(table: _Table, names: Sequence[str]) -> bool:
    return set(names) <= table.columns.keys()


def _of_stations(points: FloatArray, station: IntArray) -> Measurements:
    return StationPositions(points, station) if np.any(station) else Positions(points)


def _stations(table: _Table) -> IntArray:
    """Return the station index of each row.

    Stations are numbered in the order of appearance.
    """
    if STATION not in table.columns:
        return np.zeros(len(table.rows), dtype=np.intp)
    names = table.names_of_rows(STATION)
    numbers = {name: k for k, name in enumerate(dict.fromkeys(names))}
    return np.array([numbers[name] for name in names], dtype=np.intp)


def _orientations(table: _Table, form: Form) -> FloatArray:
    """Return the orientations (rows, 3, 3) of the measured poses."""
    table.said.append(described(form, {n: table.columns[n].heading for n in form.names}))
    values = np.stack([table.numbers(name, form.kind) for name in form.names], -1)
    try:
        return form.read(values)
    except WrongRow as wrong:
        line = table.rows[wrong.row].number
        raise InputValueError(f"{table.path}, line {line}: {wrong}") from None


def _long(table: _Table, q: FloatArray) -> MeasurementTable:
    """Read a table with one row per target.

    Rows with the same station and joint coordinates but different targets form one configuration.
    Rows that also have the same target belong to separate configurations.
    """
    names = table.names_of_rows(TARGET)
    targets = list(dict.fromkeys(names))
    xyz = table.positions(AXES)
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
    return MeasurementTable(q[first], _of_stations(points, station[first]), tuple(table.said))
