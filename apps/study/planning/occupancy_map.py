"""A map of free and occupied cells, in which a point moves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chasles import ShapeError
from chasles.summaries import summary_repr

from ..arguments import above_0, finite

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class OccupancyMap:
    """A plane of cells; the space outside is occupied.

    Attributes:
        occupied: (nx, ny) whether each cell is occupied; cell (i, j) reaches from `origin` +
            (i, j) `side` to `origin` + (i + 1, j + 1) `side`.
        side: The side of a cell [m].
        origin: (2,) the corner of the first cell [m].
    """

    occupied: BoolArray
    side: float
    origin: FloatArray

    def __repr__(self) -> str:
        """In words, with the figures that matter."""
        cells = f"{' x '.join(map(str, self.occupied.shape))} cells of {self.side:.4g} m"
        return summary_repr(self, "", cells, f"{self.occupied.mean():.1%} occupied")

    @property
    def lower(self) -> FloatArray:
        """(2,) the least coordinates [m]."""
        return self.origin

    @property
    def upper(self) -> FloatArray:
        """(2,) the largest coordinates [m]."""
        return self.origin + self.side * np.array(self.occupied.shape)

    def free(self, points: FloatArray) -> BoolArray:
        """Whether points (m, 2) lie in free cells."""
        cell = np.floor((points - self.origin) / self.side).astype(np.intp)
        return self._free_cells(cell)

    def free_way(self, a: FloatArray, b: FloatArray) -> bool:
        """Whether the straight line between two points (2,) passes through free cells only.

        The line is cut where it crosses the borders of cells, so that the answer is exact; a line
        along a border lies in the cells above it.
        """
        start, step = (a - self.origin) / self.side, (b - a) / self.side
        cuts = [np.array([0.0, 1.0])]
        for k in range(2):
            if step[k] != 0:
                low, high = sorted((start[k], start[k] + step[k]))
                borders = np.arange(np.ceil(low), np.floor(high) + 1)
                cuts.append((borders - start[k]) / step[k])
        at = np.unique(np.clip(np.concatenate(cuts), 0, 1))
        middles = start + ((at[1:] + at[:-1]) / 2)[:, None] * step
        ends = np.array([start, start + step])
        cells = np.floor(np.vstack([middles, ends])).astype(np.intp)
        return bool(self._free_cells(cells).all())

    def why(self, point: FloatArray) -> str:
        """The obstacle at a point (2,), in words."""
        x, y = point
        inside = ((point >= self.lower) & (point < self.upper)).all()
        return f"({x:g}, {y:g}) m is {'occupied' if inside else 'outside the map'}"

    def _free_cells(self, cell: NDArray[np.intp]) -> BoolArray:
        inside = np.asarray(((cell >= 0) & (cell < self.occupied.shape)).all(-1))
        i, j = np.where(inside[:, None], cell, 0).T
        return np.asarray(inside & ~self.occupied[i, j])


def occupancy_map(
    occupied: ArrayLike, side: float = 1.0, origin: ArrayLike = (0.0, 0.0)
) -> OccupancyMap:
    """A map from an array.

    Args:
        occupied: (nx, ny) whether each cell is occupied: the first index along x.
        side: The side of a cell [m].
        origin: (2,) the corner of the first cell [m].

    Raises:
        ShapeError: The array is not a matrix, or the origin not a point.
        InputValueError: The side is not positive.
    """
    cells, corner = np.asarray(occupied, dtype=bool), np.asarray(origin, dtype=np.float64)
    if cells.ndim != 2 or corner.shape != (2,):  # noqa: PLR2004 - a plane
        raise ShapeError(
            f"occupancy_map: expected (nx, ny) and (2,), got {cells.shape} and {corner.shape}"
        )
    return OccupancyMap(cells, above_0("occupancy_map: side", side), finite("origin", corner))
