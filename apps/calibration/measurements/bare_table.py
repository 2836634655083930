"""Tables without a header: columns told by their number, their size and distances that stay.

Coordinates come first or last. Targets on a tool keep their distances, and the components of a
quaternion their length: so positions of several targets are told from a pose.
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
"""Change of a distance between targets, in parts of their own motion, that a tool does not make."""
_LARGEST = 720.0
"""Largest joint angle [deg]: positions in millimetres are larger as a rule."""
_LEAST = 3
"""Fewest rows that tell whether a distance stays."""


def header_of(path: Path, rows: Sequence[TableLine], robot: Robot, said: list[str]) -> list[str]:
    """The header that a table should have; what is assumed is added to `said`.

    Raises:
        InputValueError: Its columns are not told; the message gives a header as it should be.
    """
    whole = _whole(rows)
    if len(whole) < _LEAST:
        raise _asked(path, rows, robot)
    values = np.array([[number(cell) for cell in row.cells] for row in whole])
    joints = [f"q{k + 1}" for k in range(robot.n)]
    counted = _counts(values)
    named = [*(["id"] if counted else []), *joints]
    rest = values.shape[1] - len(named)
    first, last = values[:, counted : counted + robot.n], values[:, rest + counted :]
    if rest < len(AXES):
        raise _asked(path, rows, robot)
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
        raise _asked(path, rows, robot)
    header = ends[0][0]
    said.append(f"there is no header; the columns are taken for {', '.join(header)}")
    return header


def _whole(rows: Sequence[TableLine]) -> list[TableLine]:
    """The rows with as many numbers as the first."""
    count = len(rows[0].cells)
    return [
        row
        for row in rows
        if len(row.cells) == count and all(np.isfinite(number(cell)) for cell in row.cells)
    ]


def _counts(values: FloatArray) -> int:
    """1 where the first column counts the rows, else 0."""
    return int(len(values) > 1 and bool((np.diff(values[:, 0]) == 1).all()))


def _names(count: int) -> list[str]:
    """x, y, z of one target, x1, y1, z1, x2 ... of several; other columns have none."""
    if count == len(AXES):
        return list(AXES)
    return [f"{axis}{k + 1}" for k in range(count // len(AXES)) for axis in AXES]


def _are_targets(values: FloatArray) -> bool:
    """Whether columns are positions of targets that keep their distances."""
    if values.shape[1] % len(AXES):
        return False
    points = values.reshape(len(values), -1, len(AXES))
    moved = np.linalg.norm(points.std(0), axis=-1)
    return bool((moved > 0).all()) and all(
        np.ptp(np.linalg.norm(points[:, i] - points[:, j], axis=-1)) < _KEPT * moved[i]
        for i, j in itertools.combinations(range(points.shape[1]), 2)
    )


def _asked(path: Path, rows: Sequence[TableLine], robot: Robot) -> InputValueError:
    joints = ", ".join(f"q{k + 1} [deg]" for k in range(min(robot.n, 2)))
    return InputValueError(
        f"{path}: the first line holds numbers, and its {len(rows[0].cells)} columns do not tell "
        f"which are the {robot.n} coordinates and the positions of targets; write a header such as "
        f"'{joints}, ..., x [mm], y [mm], z [mm]'"
    )
