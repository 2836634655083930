"""Computes level lines of grid values and simplifies polygons."""

import math

import numpy as np
from numpy.typing import NDArray

Point = tuple[float, float]
Loop = list[Point]
"""Corners of a closed polygon, in order."""
_AROUND = ((0, 0), (1, 0), (1, 1), (0, 1))
"""Corners of a unit square in counterclockwise order."""
_Side = tuple[int, int, int, int]


def contours(levels: NDArray[np.int_], level: float) -> list[Loop]:
    """Compute level lines by marching squares, with larger values on the left of each line.

    Args:
        levels: Values (n, m) at integer grid coordinates. The values at the grid border must be
            below the argument ``level``.
        level: The constant value on each level line. No entry of ``levels`` may equal ``level``.

    Returns:
        The level lines, as closed polygons in grid coordinates.
    """
    above = levels > level
    total = sum(above[i : above.shape[0] - 1 + i, j : above.shape[1] - 1 + j] for i, j in _AROUND)
    follows: dict[_Side, _Side] = {}
    for i, j in np.argwhere((np.asarray(total, dtype=int) % 4) > 0).tolist():
        follows |= _crossed(above, i, j)
    loops = []
    while follows:
        side = start = next(iter(follows))
        loop = [_crossing(levels, level, start)]
        while (side := follows.pop(side)) != start:
            loop.append(_crossing(levels, level, side))
        loops.append(loop)
    return loops


def _crossed(above: NDArray[np.bool_], i: int, j: int) -> dict[_Side, _Side]:
    corners = [(i + a, j + b) for a, b in _AROUND]
    sides = [
        (min(p, q) + max(p, q), bool(above[q]))
        for p, q in zip(corners, corners[1:] + corners[:1], strict=True)
        if above[p] != above[q]
    ]
    # A level line leaves a grid cell through a side with the larger corner value on the left.
    return {side: sides[k - 1][0] for k, (side, enters) in enumerate(sides) if not enters}


def _crossing(levels: NDArray[np.int_], level: float, side: _Side) -> Point:
    i, j, k, m = side
    low, high = float(levels[i, j]), float(levels[k, m])
    part = (level - low) / (high - low)
    return i + part * (k - i), j + part * (m - j)


def area(loop: Loop) -> float:
    """Return the signed area of a polygon. Counterclockwise polygons have a positive area."""
    return (
        sum(a[0] * b[1] - a[1] * b[0] for a, b in zip(loop, loop[1:] + loop[:1], strict=True)) / 2
    )


def simplified(loop: Loop, slack: float) -> Loop:
    """Remove polygon corners at most ``slack`` away from the simplified polygon.

    Source:
        Douglas and Peucker, The Canadian Cartographer 10 (1973), 112-122.
    """
    first = min(range(len(loop)), key=lambda k: loop[k])
    ring = loop[first:] + loop[: first + 1]
    far = max(range(len(ring)), key=lambda k: math.dist(ring[0], ring[k]))
    return [*_kept(ring[: far + 1], slack), *_kept(ring[far:], slack)]


def _kept(line: Loop, slack: float) -> Loop:
    (ax, ay), (bx, by) = line[0], line[-1]
    length = math.dist(line[0], line[-1])
    if len(line) < 3 or length == 0:  # noqa: PLR2004
        return line[:1]
    away = [abs((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / length for x, y in line]
    far = max(range(len(line)), key=away.__getitem__)
    if away[far] <= slack:
        return line[:1]
    return [*_kept(line[: far + 1], slack), *_kept(line[far:], slack)]
