"""The curves on which a function of the plane is zero, as polylines."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..arrays import BoolArray, FloatArray, IntArray

Values = Callable[[FloatArray], FloatArray]
"""From points (..., 2) to values (...), NaN where there is none."""

HALVINGS = 48
"""Halvings of an interval, to 4e-15 of its length."""


def zero_curves(values: Values, x: FloatArray, y: FloatArray) -> tuple[FloatArray, ...]:
    """The curves of zeros on a grid, of which each side of a cell holds one zero at most.

    A zero on a side is found by halving, to rounding; between sides a curve is a straight line.
    Where the values change sign by way of infinity there is no curve.
    """
    grid = np.stack(np.meshgrid(x, y, indexing="ij"), -1)
    f = values(grid)
    sides, points = _zeros(values, grid, f)
    return _joined(_segments(f, sides), points)


def _zeros(values: Values, grid: FloatArray, f: FloatArray) -> tuple[IntArray, FloatArray]:
    """The sides with a zero, numbered (2, n, m) with -1 for all others, and the zeros."""
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

    def at(s: FloatArray) -> FloatArray:
        return low + s[:, None] * (high - low)

    points = at(bisected(lambda s: values(at(s)) > 0, np.zeros(len(low)), np.ones(len(low))))
    # At a pole the values grow instead.
    poles = ~(np.abs(values(points)) < size)
    points[poles] = np.nan
    return sides, points


def bisected(
    is_on: Callable[[FloatArray], BoolArray], low: FloatArray, high: FloatArray
) -> FloatArray:
    """Return the last values (N,) at which a condition is as at the lower ends of intervals."""
    before = is_on(low)
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        same = is_on(middle) == before
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return low


def _changes(first: FloatArray, second: FloatArray) -> BoolArray:
    """Whether values have different signs; False beside NaN."""
    return np.asarray(((first > 0) & (second <= 0)) | ((first <= 0) & (second > 0)))


def _segments(f: FloatArray, sides: IntArray) -> list[tuple[int, int]]:
    """Pairs of zeros that a curve joins through a cell."""
    along_x, along_y = sides
    around = np.stack([along_x[:-1, :-1], along_y[1:, :-1], along_x[:-1, 1:], along_y[:-1, :-1]])
    count = (around >= 0).sum(0)
    pairs: list[tuple[int, int]] = []
    for i, k in zip(*np.nonzero(count), strict=True):
        found = [int(n) for n in around[:, i, k] if n >= 0]
        if len(found) == 4:  # noqa: PLR2004
            # A saddle: the middle of the cell tells which corners belong together.
            middle = f[i : i + 2, k : k + 2].mean()
            turn = (middle > 0) == (f[i, k] > 0)
            bottom, right, top, left = found
            pairs += [(bottom, right), (top, left)] if turn else [(bottom, left), (top, right)]
        elif len(found) == 2:  # noqa: PLR2004
            pairs.append((found[0], found[1]))
    return pairs


def _joined(pairs: list[tuple[int, int]], points: FloatArray) -> tuple[FloatArray, ...]:
    """Polylines through the zeros."""
    neighbours: dict[int, list[int]] = {}
    for one, other in pairs:
        if np.isfinite(points[[one, other]]).all():
            neighbours.setdefault(one, []).append(other)
            neighbours.setdefault(other, []).append(one)
    curves = []
    # Open curves first, from one of their ends.
    for start in sorted(neighbours, key=lambda n: (len(neighbours[n]), n)):
        way = [start]
        while neighbours[way[-1]]:
            following = neighbours[way[-1]].pop()
            neighbours[following].remove(way[-1])
            way.append(following)
        if len(way) > 1:
            curves.append(points[way])
    return tuple(curves)
