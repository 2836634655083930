"""A grid of equal cells, and the size of the body that fills the visited ones.

Cells are counted, not points: the points of joint space are dense in some places and thin in
others. A line along x through the body visits whole cells, at each end half a cell more than it
should, on average over the position of the grid. So to first order the visited cells have a volume
that is too large by h/2 times the area of their open faces, h being the side of a cell: the open
faces along x count the area of the surface as seen along x, whatever its slope. A part 1 - c of the
cells remains along each axis, c being half of its open faces by the number of cells; the product of
the three parts is exact for boxes and never negative. Where a random half of the points misses many
of the cells that all visit, the points are too few, and larger cells are counted instead. Four
errors remain:

- Where the surface is parallel to the grid, all lines end at the same place in their cells, and the
  excess is anything between 0 and h a face. Such faces lie in a plane with their neighbors.
- A cell at the surface of which the body has a corner is missed by the points. A random half of the
  points misses more: the number of missed cells is extrapolated as a power of the number of points.
- Lines of few cells end at few places, so that their mean is left to chance.
- Bodies that are no boxes have another second order than the product.

Source:
    L. A. Santalo, Integral Geometry and Geometric Probability, 1976, chapter 13, for surfaces by
    their projections.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chasles import InputValueError
from chasles.summaries import short_repr

from .arguments import finite, whole

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.intp]
CountArray = NDArray[np.uint32]

_GROWTH = 2 / 3
"""Power of the number of points with which missed cells vanish: 1 where the surface is parallel to
the grid, 1/3 where it cuts corners off."""
_SLOPING = 0.1
"""Error of the correction at sloping faces, as a part of it: their lines end at many places."""


_CHANCE = 0.5
"""Error by the position of the grid, as a part of the root of the number of faces: a plane of few
cells has hardly one with all others around it."""
_SECOND = 0.5
"""Error of the correction's second order, as a part of it: it is exact for boxes alone."""
_MISSED = 0.1
"""Largest part of the visited cells that a random half of the points may miss: if it is more, the
number of cells that all points miss does not follow from it."""
_FEWEST = 4
"""Fewest cells along the longest side: if they are fewer, nearly all are at the surface."""


@dataclass(frozen=True, eq=False)
class Grid:
    """A box divided into equal cells.

    Attributes:
        lower: (3,) lower corner [m].
        side: The side of a cell [m].
        shape: Number of cells along x, y and z; 1 along a direction without extent.
    """

    lower: FloatArray
    side: float
    shape: tuple[int, int, int]

    __repr__ = short_repr

    @classmethod
    def from_bounds(cls, lower: ArrayLike, upper: ArrayLike, resolution: int) -> Self:
        """Return the grid that covers a box, and on average half a cell more at each side.

        Args:
            lower: (3,) lower corner [m].
            upper: (3,) upper corner [m].
            resolution: Number of cells along the longest side, at least 2.

        Raises:
            ShapeError: A corner is not (3,).
            InputValueError: The box has no extent, the corners are not finite or in the wrong
                order.
        """
        lower = finite("Grid.from_bounds: lower", lower, (3,))
        upper = finite("Grid.from_bounds: upper", upper, (3,))
        whole("Grid.from_bounds: resolution", resolution, 2)
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
        """Number of directions with more than one cell."""
        return sum(n > 1 for n in self.shape)

    def centers(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(nx,), (ny,), (nz,) coordinates of the cell centers [m]."""
        x, y, z = (
            low + self.side * (np.arange(n) + 0.5)
            for low, n in zip(self.lower, self.shape, strict=True)
        )
        return x, y, z


def indices(grid: Grid, points: FloatArray) -> IntArray:
    """Return the cells of points.

    Args:
        grid: The grid.
        points: (m, 3) positions [m].

    Returns:
        (m,) indices into an array of `count` cells in C order; points outside the box belong to the
        nearest cell, and NaN to `count`.
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
"""Extent along a direction below which a body is flat, in parts of its longest extent."""


class SizeEstimate(NamedTuple):
    """A volume, an area or a length, by the dimension of the body.

    Attributes:
        value: The estimate.
        error: Its error, as large as it usually is at most.
        unit: "m^3", "m^2" or "m".
    """

    value: float
    error: float
    unit: str

    def __str__(self) -> str:
        """The value with its error and its unit: volume 3.25 ± 0.02 m^3."""
        name = {"m": "length", "m^2": "area"}.get(self.unit, "volume")
        return f"{name} {self.value:.4g} ± {self.error:.2g} {self.unit}"


def size_of(grid: Grid, hits: CountArray) -> SizeEstimate:
    """Estimate the volume, area or length of the body that fills the visited cells.

    Adjacent cells are joined as long as the points are too few for the cells.

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
    # The points are too few for any cells: the body is anything in the box.
    box = grid.count * grid.side**grid.dimension
    return SizeEstimate(box / 2, box / 2, unit)


def _estimate(visited: BoolArray, halved: BoolArray) -> tuple[float, float]:
    """Number of filled cells and its error, from the cells that all and half the points visit."""
    value, error = _corrected(visited)
    unseen = (value - _corrected(halved)[0]) / (2**_GROWTH - 1)
    return max(value + unseen, 0.0), error + abs(unseen)


def _joined(hits: CountArray, times: int) -> CountArray:
    """The hits in cells of a multiple of the side; the middle of the box stays where it is."""
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
    """The cells without holes of a single cell, which chance leaves inside the body."""
    padded = np.pad(visited, [(1, 1) if n > 1 else (0, 0) for n in visited.shape])
    axes = [axis for axis, n in enumerate(visited.shape) if n > 1]
    beside = sum(np.roll(padded, step, axis).astype(np.int8) for axis in axes for step in (1, -1))
    inside = padded | (beside >= 2 * len(axes) - 1)
    return np.asarray(inside[tuple(slice(1, -1) if n > 1 else slice(None) for n in visited.shape)])


def _corrected(visited: BoolArray) -> tuple[float, float]:
    """Number of cells that the body fills, at least 0, and the error of the correction."""
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
    """Open faces along each axis, those in a plane with all faces around them, and the others."""
    level, whole = np.zeros(visited.ndim), np.zeros(visited.ndim)
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
            whole[axis] += faces.sum()
            level[axis] += inner.sum()
    return level, whole - level
