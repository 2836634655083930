"""Infer the columns of a measurement table without a header from their number and values.

The first or the last columns of the table contain the coordinates of the robot. All other columns
contain target positions, except for an optional row counter. The mutual distances of the targets
must be nearly the same in all rows.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chasles import InputValueError, Robot

from .headings import AXES
from .table_text import TableLine, number

FloatArray = NDArray[np.float64]

_KEPT = 0.05
"""Two targets count as fixed to one tool if their distance changes by less than this fraction of
their motion."""
_LARGEST = 720.0
"""Maximum absolute value in a column of joint angles [deg]."""
_MIN = 3
"""Minimum number of complete table rows for inferring the columns. If a table has fewer complete
rows than this number, an error asks for a header."""


def header_of(path: Path, rows: Sequence[TableLine], robot: Robot, said: list[str]) -> list[str]:
    """Infer the header of a table without a header.

    Append each assumption as text to the list `said`.

    Raises:
        InputValueError: The meaning of the columns is ambiguous. The error message shows an example
            of a header.
    """
    complete = _whole(rows)
    if len(complete) < _MIN:
        raise _header_error(path, rows, robot)
    values = np.array([[number(cell) for cell in row.cells] for row in complete])
    joints = [f"q{k + 1}" for k in range(robot.n)]
    counted = _counts(values)
    named = [*(["id"] if counted else []), *joints]
    rest = values.shape[1] - len(named)
    first, last = values[:, counted : counted + robot.n], values[:, rest + counted :]
    if rest < len(AXES):
        raise _header_error(path, rows, robot)
    ends = [
        (header, positions)
        for header, own, positions in (
            ([*named, *_names(rest)], first, values[:, len(named) :]),
            ([*named[:counted], *_names(rest), *joints], last, values[:, counted : counted + rest]),
        )
        if np.abs(own).max() <= _LARGEST and _are_targets(positions)
    ]
    if len(ends) > 1 and np.abs(ends[0][1]).max() < np.abs(first).max():
        ends = ends[1:]
    if not ends:
        raise _header_error(path, rows, robot)
    header = ends[0][0]
    said.append(f"there is no header; the columns are assumed to be {', '.join(header)}")
    return header


def _whole(rows: Sequence[TableLine]) -> list[TableLine]:
    count = len(rows[0].cells)
    return [
        row
        for row in rows
        if len(row.cells) == count and all(np.isfinite(number(cell)) for cell in row.cells)
    ]


def _counts(values: FloatArray) -> int:
    """Return 1 if the first column is a row counter, otherwise 0."""
    return int(len(values) > 1 and bool((np.diff(values[:, 0]) == 1).all()))


def _names(count: int) -> list[str]:
    """Return the column names x, y, z for one target, or numbered names for several targets."""
    if count == len(AXES):
        return list(AXES)
    return [f"{axis}{k + 1}" for k in range(count // len(AXES)) for axis in AXES]


def _are_targets(values: FloatArray) -> bool:
    """Return whether the columns are positions of targets with constant mutual distances."""
    if values.shape[1] % len(AXES):
        return False
    points = values.reshape(len(values), -1, len(AXES))
    moved = np.linalg.norm(points.std(0), axis=-1)
    return bool((moved > 0).all()) and all(
        np.ptp(np.linalg.norm(points[:, i] - points[:, j], axis=-1)) < _KEPT * moved[i]
        for i, j in itertools.combinations(range(points.shape[1]), 2)
    )


def _header_error(path: Path, rows: Sequence[TableLine], robot: Robot) -> InputValueError:
    joints = ", ".join(f"q{k + 1} [deg]" for k in range(min(robot.n, 2)))
    return InputValueError(
        f"{path}: the first line contains numbers instead of a header, and the meaning of the "
        f"{len(rows[0].cells)} columns is ambiguous; write a header with {robot.n} coordinates, "
        f"such as '{joints}, ..., x [mm], y [mm], z [mm]'"
    )
