"""Where a robot can put its tool without turning it: cells, asked by the closed-form inverse.

The middles of cells are put through the inverse with all branches, within limits. Cells beside
others that differ are divided until they are fine enough, so that the work grows with the surface
alone. Between eight middles that differ lies the border: half of the volume there is counted, and
half of it is the error, a bound as long as no part of the border hides between middles that agree.
The error of the value is much less as a rule, and shrinks with the cells.
"""

from __future__ import annotations

import itertools
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chasles import InputValueError, OutOfReachError, Robot, ShapeError
from chasles.summaries import ranges, summary_repr

from .arguments import finite
from .cells import Cells, Measure
from .reach import reach

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_COARSE = 32
"""Cells along each side at the start."""
_FIRST, _REST = slice(None, -1), slice(1, None)
_GROWTH = 1.5
_FITS = 12
"""How often the box is fitted to what is reached; each time it grows or shrinks."""


@dataclass(frozen=True, eq=False)
class ReachedPositions:
    """Where a tool can be at one orientation.

    Attributes:
        robot: The robot's name.
        R_0_ee: (3, 3) the orientation.
        cells: The finest cells.
        inside: (nx, ny, nz) whether the middle of each cell is reached.
    """

    robot: str
    R_0_ee: FloatArray
    cells: Cells
    inside: BoolArray

    def __repr__(self) -> str:
        """In words, with the figures that matter."""
        return summary_repr(
            self,
            self.robot,
            str(self.measure),
            ranges(self.extents),
            f"{' x '.join(map(str, self.cells.shape))} cells of {self.cells.side:.4g} m",
            methods="plot(), to_npz(path)",
        )

    @property
    def measure(self) -> Measure:
        """The volume [m^3]; its error is a bound from the cells at the border."""
        corners = [self.inside[at] for at in itertools.product((_FIRST, _REST), repeat=3)]
        whole, some = np.logical_and.reduce(corners), np.logical_or.reduce(corners)
        of_cell = self.cells.side**3
        cut = float((some & ~whole).sum()) * of_cell / 2
        return Measure(float(whole.sum()) * of_cell + cut, cut, 3)

    @property
    def extents(self) -> FloatArray:
        """(2, 3) least and largest x, y and z of the cells that are reached [m], to a cell."""
        corners = np.argwhere(self.inside)
        lower = self.cells.lower + self.cells.side * corners.min(0)
        return np.array([lower, self.cells.lower + self.cells.side * (corners.max(0) + 1)])

    def to_npz(self, path: str | os.PathLike[str]) -> None:
        """Writes all data to a compressed file that NumPy reads."""
        np.savez_compressed(
            Path(path),
            robot=self.robot,
            R_0_ee=self.R_0_ee,
            lower=self.cells.lower,
            side=self.cells.side,
            inside=self.inside,
        )

    def plot(self, ax: Any = None) -> Any:
        """Draws how far the tool reaches up and to the side: sums of cells along z and along y.

        Args:
            ax: Two matplotlib axes; None: a new figure.

        Returns:
            The axes.
        """
        from .pictures import plot_positions  # noqa: PLC0415

        return plot_positions(self, ax)


def positions(
    robot: Robot,
    R_0_ee: ArrayLike | None = None,
    *,
    finest: int = 256,
    seed: ArrayLike | None = None,
) -> ReachedPositions:
    """Where a robot can put its tool at one orientation, within limits, on any branch.

    Args:
        robot: A robot with `ik`, such as a platform on six legs or a delta robot.
        R_0_ee: (3, 3) the orientation; None: that of the reference posture.
        finest: Cells along each side of the box, a power of two times 32.
        seed: (3,) a place that is reached [m]; None: that of the reference posture.

    Raises:
        AttributeError: The robot has no `ik`.
        InputValueError: `finest` is not such a number, a number is not finite, or the robot has no
            reference posture and no seed is given.
        OutOfReachError: No cell near the seed is reached.
        ShapeError: The orientation is not (3, 3), or the seed not (3,).
    """
    levels = int(finest // _COARSE).bit_length() - 1
    if finest != _COARSE * 2 ** max(levels, 0):
        raise InputValueError(
            f"positions: expected finest {_COARSE} times a power of two, got {finest}"
        )
    R, start = _orientation(robot, R_0_ee, seed)
    lower, side, inside = _fitted(robot, R, start)
    for _ in range(levels):
        side /= 2
        open_cells = np.repeat(np.repeat(np.repeat(_border(inside), 2, 0), 2, 1), 2, 2)
        inside = np.repeat(np.repeat(np.repeat(inside, 2, 0), 2, 1), 2, 2)
        cells = np.argwhere(open_cells)
        inside[open_cells] = _reached(robot, R, lower + side * (cells + 0.5))
    nx, ny, nz = inside.shape
    return ReachedPositions(robot.name, R, Cells(lower, side, (nx, ny, nz)), inside)


def _orientation(
    robot: Robot, R_0_ee: ArrayLike | None, seed: ArrayLike | None
) -> tuple[FloatArray, FloatArray]:
    if (R_0_ee is None or seed is None) and robot.reference is None:
        raise InputValueError(
            f"positions: {robot.name} has no reference posture; give R_0_ee and seed"
        )
    T = np.eye(4) if robot.reference is None else robot.fk(np.array(robot.reference.q))
    R = finite("positions: R_0_ee", T[:3, :3] if R_0_ee is None else R_0_ee)
    start = finite("positions: seed", T[:3, 3] if seed is None else seed)
    if R.shape != (3, 3) or start.shape != (3,):
        raise ShapeError(
            f"positions: expected R_0_ee (3, 3) and seed (3,), got {R.shape} and {start.shape}"
        )
    return R, start


def _fitted(robot: Robot, R: FloatArray, start: FloatArray) -> tuple[FloatArray, float, BoolArray]:
    """A box of cells around all that is reached: its lower corner, a side and the cells."""
    middle, size = start, 2 * robot.unit_length
    for _ in range(_FITS):
        side = size / _COARSE
        lower = middle - size / 2
        grid = np.indices((_COARSE,) * 3).reshape(3, -1).T
        inside = _reached(robot, R, lower + side * (grid + 0.5)).reshape((_COARSE,) * 3)
        if not inside.any():
            size /= 2
            continue
        least, most = (end(np.argwhere(inside), axis=0) for end in (np.min, np.max))
        if (least == 0).any() or (most == _COARSE - 1).any():
            size *= _GROWTH
            continue
        if (most - least).max() + 1 >= _COARSE // 2:
            return lower, side, inside
        middle = lower + side * (least + most + 1) / 2
        size = side * ((most - least).max() + 3)
    raise OutOfReachError(f"{robot.name}: no box around the reached positions near {start} found")


def _reached(robot: Robot, R: FloatArray, places: FloatArray) -> BoolArray:
    """Whether places (m, 3) are reached."""
    if not len(places):
        return np.zeros(0, dtype=bool)
    return np.asarray(reach(robot, places, R[None], progress=False).reached[:, 0])


def _border(inside: BoolArray) -> BoolArray:
    """The cells with a neighbour, across a face, an edge or a corner, that differs from them."""
    padded = np.pad(inside, 1)
    least, most = padded.copy(), padded.copy()
    for axis in range(3):
        pair = [np.roll(least, step, axis) for step in (1, -1)]
        least = least & pair[0] & pair[1]
        pair = [np.roll(most, step, axis) for step in (1, -1)]
        most = most | pair[0] | pair[1]
    return np.asarray((least != most)[1:-1, 1:-1, 1:-1])
