"""Grids of equal cells, and estimates of a body's volume from the cells that contain sample points.

A visited cell contains at least one sample point. The volume estimate counts visited cells instead
of points, because the density of points is not uniform. The visited cells have a larger volume than
the body. Along a line parallel to x, the visited cells extend beyond each end of the body by half a
cell on average. An open face is a face between a visited cell and a cell that was not visited. For
cells of side h, the volume of the visited cells exceeds the body volume by h/2 times the area of
the open faces. The total area of the open faces normal to x equals the area of the body's surface
projected along x. Let c be half the number of open faces normal to an axis, divided by the number
of visited cells. The estimate multiplies the volume of the visited cells by the correction factor 1
- c of each axis. The corrected volume is exact for boxes and never negative. If a random half of
the points misses many visited cells, the points are too few for this cell size, and larger cells
are used.

The volume estimate has four remaining errors. First, if the body surface is parallel to cell faces,
all lines normal to it leave the body at the same position within a cell. For such a parallel
surface, the visited cells exceed the body volume by 0 to h times the area of the open faces. On a
surface parallel to cell faces, adjacent open faces are coplanar. Second, the points may miss a cell
that contains only a small corner of the body. The number of missed cells is assumed to decrease as
a power of the number of points. The number of missed cells is estimated by comparing the cells
visited by all points with the cells visited by a random half. Third, the volume correction uses the
average distance by which the visited cells extend beyond the body. If the body covers few cells,
this average distance is inaccurate, because only few lines contribute to it. Fourth, the volume
correction by the factors 1 - c is exact only for boxes.

Source:
    L. A. Santalo, Integral Geometry and Geometric Probability, 1976, chapter 13, for the area
    of a surface from its projections.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chasles import InputValueError
from chasles.summaries import short_repr

from .arguments import finite, integer_at_least

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.intp]
CountArray = NDArray[np.uint32]

_GROWTH = 2 / 3
"""Exponent for the assumption that the number of missed cells is proportional to 1 / (number of
points)^_GROWTH."""
_SLOPING = 0.1
"""Relative error of the volume correction at sloping surfaces, where adjacent open faces are not
coplanar."""


_CHANCE = 0.5
_SECOND = 0.5
"""Assumed error of the correction terms of second and higher order, as a fraction of these terms.
"""
_MISSED = 0.1
"""Maximum fraction of the visited cells that a random half of the points may miss before adjacent
cells are merged."""
_FEWEST = 4
"""Minimum number of cells along the longest side of the grid after cells are merged."""
_MAX_CELLS = 10**9
"""Maximum number of cells of a grid. The point counts of a billion cells take 4 GB of memory."""


@dataclass(frozen=True, eq=False)
class Grid:
    """A box divided into equal cubic cells.

    Attributes:
        lower: (3,) lower corner [m].
        side: Side length of the cubic cells [m].
        shape: Numbers of cells along x, y and z. The number is 1 along an axis in which the box has
            no extent.
    """

    lower: FloatArray
    side: float
    shape: tuple[int, int, int]

    __repr__ = short_repr

    @classmethod
    def from_bounds(cls, lower: ArrayLike, upper: ArrayLike, resolution: int) -> Self:
        """Return a grid that covers a box with a margin.

        The grid extends beyond each side of the box by half a cell to one cell.

        Args:
            lower: (3,) lower corner [m].
            upper: (3,) upper corner [m].
            resolution: Number of cells along the longest side, at least 2.

        Raises:
            ShapeError: A corner does not have the shape (3,).
            InputValueError: The corners are equal, not finite or not in ascending order, or the
                grid would have more than 1e9 cells.
        """
        lower = finite("Grid.from_bounds: lower", lower, (3,))
        upper = finite("Grid.from_bounds: upper", upper, (3,))
        integer_at_least("Grid.from_bounds: resolution", resolution, 2)
        if (upper < lower).any() or not (upper > lower).any():
            raise InputValueError(
                f"Grid.from_bounds: expected lower < upper, got {lower} and {upper}"
            )
        extent = upper - lower
        flat = extent <= _FLAT * extent.max()
        side = float(extent.max()) / (resolution - 1)
        shape = np.where(flat, 1, np.ceil(extent / side - _FLAT) + 1).astype(int)
        middle = (lower + upper) / 2
        nx, ny, nz = (int(n) for n in shape)
        if nx * ny * nz > _MAX_CELLS:
            raise InputValueError(
                f"resolution = {resolution}: the grid is too fine; expected at most "
                f"{_MAX_CELLS:,} cells, got {nx} x {ny} x {nz}; choose a smaller resolution"
            )
        return cls(middle - side * shape / 2, side, (nx, ny, nz))

    @property
    def upper(self) -> FloatArray:
        """(3,) upper corner [m]."""
        return self.lower + self.side * np.array(self.shape)

    @property
    def count(self) -> int:
        """Number of cells."""
        return int(np.prod(self.shape))

    @property
    def dimension(self) -> int:
        """Number of axes (0 to 3) along which the grid has more than one cell."""
        return sum(n > 1 for n in self.shape)

    def centers(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the x (nx,), y (ny,) and z (nz,) coordinates of the cell centers [m]."""
        x, y, z = (
            low + self.side * (np.arange(n) + 0.5)
            for low, n in zip(self.lower, self.shape, strict=True)
        )
        return x, y, z


def indices(grid: Grid, points: FloatArray) -> IntArray:
    """Return the index of the grid cell that contains each point.

    Args:
        grid: The grid.
        points: (m, 3) positions [m].

    Returns:
        (m,) cell indices in C order. Points outside the grid have the index of the nearest cell. A
        point that contains NaN has the index `grid.count`, which belongs to no cell.
    """
    nx, ny, nz = grid.shape
    place = points - grid.lower
    place *= 1 / grid.side
    missing = np.isnan(place[:, 0])
    if missing.any():
        place[missing] = 0
    cell = place.astype(np.int32)
    np.clip(cell, 0, np.array([nx - 1, ny - 1, nz - 1], dtype=np.int32), out=cell)
    flat = (cell[:, 0] * np.intp(ny) + cell[:, 1]) * nz + cell[:, 2]
    if missing.any():
        flat[missing] = grid.count
    return np.asarray(flat, dtype=np.intp)


_FLAT = 1e-9
"""A box counts as flat along an axis if its extent along this axis is at most this fraction of its
largest extent."""


class SizeEstimate(NamedTuple):
    """The estimated volume, area or length of a workspace, depending on its dimension.

    Attributes:
        value: Estimated volume, area or length, in `unit`.
        error: Estimated error of `value`, usually an upper bound of the true error.
        unit: Unit of `value` and `error`: "m^3", "m^2" or "m".
    """

    value: float
    error: float
    unit: str

    def __str__(self) -> str:
        """Return a text with value, error and unit, such as "volume 3.25 ± 0.02 m^3"."""
        name = {"m": "length", "m^2": "area"}.get(self.unit, "volume")
        return f"{name} {self.value:.4g} ± {self.error:.2g} {self.unit}"


def size_of(grid: Grid, hits: CountArray) -> SizeEstimate:
    """Estimate the length, area or volume of a body from the cells that contain points.

    If there are too few points for the number of cells, adjacent cells are merged.

    Args:
        grid: The grid.
        hits: (nx, ny, nz) number of points in each cell.
    """
    unit = {1: "m", 2: "m^2"}.get(grid.dimension, "m^3")
    half = np.random.default_rng(0).binomial(hits, 0.5).astype(hits.dtype)
    for times in range(1, max(grid.shape) // _FEWEST + 1):
        all_points, some = (_filled(_joined(points, times) > 0) for points in (hits, half))
        if all_points.sum() - some.sum() <= _MISSED * all_points.sum():
            value, error = _estimate(all_points, some)
            of_cell = (times * grid.side) ** grid.dimension
            return SizeEstimate(value * of_cell, error * of_cell, unit)
    # Even the largest merged cells contain too few points. The estimate is half the size of the
    # box, because the size of the body is between 0 and the size of the box.
    box = grid.count * grid.side**grid.dimension
    return SizeEstimate(box / 2, box / 2, unit)


def _estimate(visited: BoolArray, halved: BoolArray) -> tuple[float, float]:
    """Return (size of the body, error of this size), both as numbers of cells.

    The array `visited` marks the cells that contain points. The array `halved` marks the cells that
    contain points of a random half of all points.
    """
    value, error = _corrected(visited)
    unseen = (value - _corrected(halved)[0]) / (2**_GROWTH - 1)
    return max(value + unseen, 0.0), error + abs(unseen)


def _joined(hits: CountArray, times: int) -> CountArray:
    """Return the point counts after merging `times` adjacent cells along each axis."""
    if times == 1:
        return hits
    joined = hits
    for axis, n in enumerate(hits.shape):
        if n > 1:
            count = -(-(n + times - 1) // times)
            before = (count * times - n) // 2
            shape = list(joined.shape)
            shape[axis] = count * times
            padded = np.zeros(shape, dtype=hits.dtype)
            place = [slice(None)] * padded.ndim
            place[axis] = slice(before, before + n)
            padded[tuple(place)] = joined
            shape[axis : axis + 1] = [count, times]
            joined = padded.reshape(shape).sum(axis + 1, dtype=hits.dtype)
    return joined


def _filled(visited: BoolArray) -> BoolArray:
    """Return the visited cells, with holes of a single cell filled."""
    padded = np.pad(visited, [(1, 1) if n > 1 else (0, 0) for n in visited.shape])
    axes = [axis for axis, n in enumerate(visited.shape) if n > 1]
    adjacent = sum(np.roll(padded, step, axis).astype(np.int8) for axis in axes for step in (1, -1))
    inside = padded | (adjacent >= 2 * len(axes) - 1)
    return np.asarray(inside[tuple(slice(1, -1) if n > 1 else slice(None) for n in visited.shape)])


def _corrected(visited: BoolArray) -> tuple[float, float]:
    """Return (number of visited cells after the volume correction, error of this number)."""
    count = float(visited.sum())
    if count == 0:
        return 0.0, 0.0
    level, sloping = _open_faces(visited)
    value = count * float(np.prod(1 - (level + sloping) / (2 * count)))
    first = count - float((level + sloping).sum()) / 2
    surface = float(level.sum() + _SLOPING * sloping.sum()) / 2
    chance = _CHANCE * float(np.sqrt(level + sloping).sum())
    return value, surface + chance + _SECOND * (value - first)


def _open_faces(visited: BoolArray) -> tuple[FloatArray, FloatArray]:
    """Return the numbers of level and of sloping open faces normal to each axis.

    An open face separates a visited cell from an unvisited cell. An open face is level if the
    adjacent faces in its plane are also open.
    """
    level, total = np.zeros(visited.ndim), np.zeros(visited.ndim)
    padded = np.pad(visited, [(1, 1) if n > 1 else (0, 0) for n in visited.shape])
    axes = [axis for axis, n in enumerate(visited.shape) if n > 1]
    for axis in axes:
        across = np.diff(padded.astype(np.int8), axis=axis)
        for side in (1, -1):
            faces = across == side
            inner = faces.copy()
            for other in axes:
                if other != axis:
                    inner &= np.roll(faces, 1, other) & np.roll(faces, -1, other)
            total[axis] += faces.sum()
            level[axis] += inner.sum()
    return level, total - level
