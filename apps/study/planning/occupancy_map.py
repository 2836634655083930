"""A planar map of free and occupied cells, in which a point moves."""

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
    """A planar grid of free and occupied cells.

    The space outside the grid counts as occupied.

    Attributes:
        occupied: (nx, ny) mask of the occupied cells. Cell (i, j) extends from `origin` + (i, j)
            `cell_size` to `origin` + (i + 1, j + 1) `cell_size`.
        cell_size: Side length of a cell [m].
        origin: (2,) corner of cell (0, 0) with the smallest x and y [m].
    """

    occupied: BoolArray
    cell_size: float
    origin: FloatArray

    def __repr__(self) -> str:
        """Short summary with the main values."""
        cells = f"{' x '.join(map(str, self.occupied.shape))} cells of {self.cell_size:.4g} m"
        return summary_repr(self, "", cells, f"{self.occupied.mean():.1%} occupied")

    @property
    def lower(self) -> FloatArray:
        """(2,) smallest x and y of the map [m]."""
        return self.origin

    @property
    def upper(self) -> FloatArray:
        """(2,) largest x and y of the map [m]."""
        return self.origin + self.cell_size * np.array(self.occupied.shape)

    def is_free(self, q: FloatArray) -> BoolArray:
        """Return a mask (m,) of the points (m, 2) [m] in free cells."""
        cell = np.floor((q - self.origin) / self.cell_size).astype(np.intp)
        return self._free_cells(cell)

    def is_free_segment(self, a: FloatArray, b: FloatArray) -> bool:
        """Return whether the whole segment between points a (2,) and b (2,) is in free cells.

        The segment is cut at cell borders, so the test is exact. A segment along a cell border
        belongs to the cells with the larger index.
        """
        start, step = (a - self.origin) / self.cell_size, (b - a) / self.cell_size
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

    def explain(self, q: FloatArray) -> str:
        """Return the reason why a point (2,) is not free."""
        x, y = q
        inside = ((q >= self.lower) & (q < self.upper)).all()
        return f"({x:g}, {y:g}) m is {'occupied' if inside else 'outside the map'}"

    def _free_cells(self, cell: NDArray[np.intp]) -> BoolArray:
        inside = np.asarray(((cell >= 0) & (cell < self.occupied.shape)).all(-1))
        i, j = np.where(inside[:, None], cell, 0).T
        return np.asarray(inside & ~self.occupied[i, j])


def occupancy_map(
    occupied: ArrayLike, cell_size: float = 1.0, origin: ArrayLike = (0.0, 0.0)
) -> OccupancyMap:
    """Return an occupancy map of a planar space, for planners such as `prm`.

    Args:
        occupied: (nx, ny) mask of the occupied cells. The first array index counts along x.
        cell_size: Side length of a cell [m].
        origin: (2,) corner of cell (0, 0) with the smallest x and y [m].

    Raises:
        ShapeError: `occupied` is not (nx, ny), or `origin` is not (2,).
        InputValueError: `cell_size` is not above 0.
    """
    cells, corner = np.asarray(occupied, dtype=bool), finite("occupancy_map: origin", origin)
    if cells.ndim != 2 or corner.shape != (2,):  # noqa: PLR2004 - a plane has two dimensions
        raise ShapeError(
            f"occupancy_map: expected occupied (nx, ny) and origin (2,), got {cells.shape} and "
            f"{corner.shape}"
        )
    return OccupancyMap(
        cells, above_0("occupancy_map: cell_size", cell_size), finite("origin", corner)
    )
