"""Zero curves of a function on a plane, as polylines."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from chasles.contract import requires

BoolArray = NDArray[np.bool_]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]
Values = Callable[[FloatArray], FloatArray]
"""A function from points (..., 2) to values (...), with NaN outside its domain."""


def zero_curves(values: Values, x: FloatArray, y: FloatArray) -> tuple[FloatArray, ...]:
    """Return the zero curves of a function, computed from its values on a grid.

    Zeros on grid edges are refined to double precision. A sign change at a pole of the function is
    not a zero.
    """
    grid = np.stack(np.meshgrid(x, y, indexing="ij"), -1)
    f = values(grid)
    sides, points = _zeros(values, grid, f)
    return _joined(_segments(f, sides), points)


def _zeros(values: Values, grid: FloatArray, f: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return the index (2, n, m) of the zero on each grid edge, and the zeros (k, 2).

    A grid edge without a zero has the index -1.
    """
    sides = np.full((2, *f.shape), -1)
    starts: list[FloatArray] = []
    ends: list[FloatArray] = []
    for axis in (0, 1):
        first, second = (np.take(f, range(k, f.shape[axis] - 1 + k), axis) for k in (0, 1))
        index = np.nonzero(_changes(first, second))
        other = tuple(i + (k == axis) for k, i in enumerate(index))
        sides[(axis, *index)] = np.arange(len(index[0])) + sum(len(part) for part in starts)
        starts.append(grid[index])
        ends.append(grid[other])
    low, high = np.concatenate(starts), np.concatenate(ends)
    if not len(low):
        return sides, low
    size = np.abs(values(low)) + np.abs(values(high))

    with requires("chasles[study]"):
        from scipy.optimize.elementwise import find_root  # noqa: PLC0415

    def f_at(s: FloatArray, row: IntArray) -> FloatArray:
        return values(low[row] + s[:, None] * (high[row] - low[row]))

    zero, one = np.zeros(len(low)), np.ones(len(low))
    s = find_root(f_at, (zero, one), args=(np.arange(len(low)),)).x
    points = low + s[:, None] * (high - low)
    # A sign change at a pole is not a zero, because the absolute function values increase near a
    # pole.
    points[~(np.abs(values(points)) < size)] = np.nan
    return sides, points


def _changes(first: FloatArray, second: FloatArray) -> BoolArray:
    """Return whether two values have different signs, where 0 counts as negative."""
    return np.asarray(((first > 0) & (second <= 0)) | ((first <= 0) & (second > 0)))


def _segments(f: FloatArray, sides: IntArray) -> list[tuple[int, int]]:
    """Return the index pairs of zeros that a zero curve connects within a grid cell."""
    along_x, along_y = sides
    around = np.stack([along_x[:-1, :-1], along_y[1:, :-1], along_x[:-1, 1:], along_y[:-1, :-1]])
    count = (around >= 0).sum(0)
    pairs: list[tuple[int, int]] = []
    for i, k in zip(*np.nonzero(count), strict=True):
        found = [int(n) for n in around[:, i, k] if n >= 0]
        if len(found) == 4:  # noqa: PLR2004
            # If f is zero at four points on the border of a cell, two curves f = 0 cross the cell.
            # The sign of f at the cell center decides which two zeros are on the same curve.
            middle = f[i : i + 2, k : k + 2].mean()
            turn = (middle > 0) == (f[i, k] > 0)
            bottom, right, top, left = found
            pairs += [(bottom, right), (top, left)] if turn else [(bottom, left), (top, right)]
        elif len(found) == 2:  # noqa: PLR2004
            pairs.append((found[0], found[1]))
    return pairs


def _joined(pairs: list[tuple[int, int]], points: FloatArray) -> tuple[FloatArray, ...]:
    """Return the polylines that connect the pairs of zeros."""
    neighbors: dict[int, list[int]] = {}
    for one, other in pairs:
        if np.isfinite(points[[one, other]]).all():
            neighbors.setdefault(one, []).append(other)
            neighbors.setdefault(other, []).append(one)
    curves = []
    # Open zero curves are traced before closed curves. Each open curve is followed from one end.
    for start in sorted(neighbors, key=lambda n: (len(neighbors[n]), n)):
        path = [start]
        while neighbors[path[-1]]:
            following = neighbors[path[-1]].pop()
            neighbors[following].remove(path[-1])
            path.append(following)
        if len(path) > 1:
            curves.append(points[path])
    return tuple(curves)
