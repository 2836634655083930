"""Reachable tool positions at a constant tool orientation.

A grid cell is reachable if the inverse kinematics has a solution at its center within the joint
limits, on any branch. A cell is subdivided down to the required resolution if its reachability
differs from the reachability of an adjacent cell. The number of tested cells therefore grows with
the surface of the reachable region, not with its volume. The border of the reachable region lies
between reachable and unreachable cell centers. The stated volume of the region counts each border
cell as half a cell. The stated error is half of the total volume of the border cells. The stated
error is an upper bound if the border never passes between two adjacent centers that are both
reachable or both unreachable. The actual error of the volume is usually much smaller and decreases
with the cell size.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chasles import InputValueError, OutOfReachError, Robot
from chasles.contract import check_type
from chasles.summaries import summary_repr

from .arguments import finite
from .grid import Grid, SizeEstimate
from .reach import reach
from .results import StudyResult, ranges

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_COARSE = 32
"""Initial number of cells along each side of the cube around the reachable positions."""
_FIRST, _REST = slice(None, -1), slice(1, None)
_GROWTH = 1.5
_FITS = 12
"""Maximum number of times that the search box is enlarged or reduced to fit the reached positions.
"""


@dataclass(frozen=True, eq=False)
class ReachablePositions(StudyResult):
    """The tool positions that a robot reaches at one tool orientation.

    Attributes:
        robot: The robot's name.
        R_0_ee: (3, 3) rotation matrix of the tool in the base frame.
        grid: The grid of cells, in the base frame.
        inside: (nx, ny, nz) mask of the cells whose centers are reached.
    """

    _parts = (Grid,)

    robot: str
    R_0_ee: FloatArray
    grid: Grid
    inside: BoolArray

    def __repr__(self) -> str:
        """Short summary with the main values."""
        return summary_repr(
            self,
            self.robot,
            str(self.size),
            ranges(self.bounds),
            f"{' x '.join(map(str, self.grid.shape))} cells of {self.grid.side:.4g} m",
            methods="plot(), save(path)",
        )

    @property
    def size(self) -> SizeEstimate:
        """Volume of reachable positions [m^3], with an error bound from the cells at the border."""
        corners = [self.inside[at] for at in itertools.product((_FIRST, _REST), repeat=3)]
        all_corners, some = np.logical_and.reduce(corners), np.logical_or.reduce(corners)
        of_cell = self.grid.side**3
        cut = float((some & ~all_corners).sum()) * of_cell / 2
        return SizeEstimate(float(all_corners.sum()) * of_cell + cut, cut, "m^3")

    @property
    def bounds(self) -> FloatArray:
        """(2, 3) smallest and largest x, y and z of the reached cells [m]."""
        corners = np.argwhere(self.inside)
        lower = self.grid.lower + self.grid.side * corners.min(0)
        return np.array([lower, self.grid.lower + self.grid.side * (corners.max(0) + 1)])

    def plot(self, ax: Any = None) -> Any:
        """Plot the extent of the reachable positions along z and along y.

        Args:
            ax: Two matplotlib axes, or None for a new figure.

        Returns:
            The axes.
        """
        from .pictures import plot_positions  # noqa: PLC0415

        return plot_positions(self, ax)


def reachable_positions(
    robot: Robot,
    R_0_ee: ArrayLike | None = None,
    *,
    resolution: int = 256,
    q_seed: ArrayLike | None = None,
) -> ReachablePositions:
    """Return the tool positions that a robot reaches within its limits at one tool orientation.

    Args:
        robot: A robot with `ik`, such as a Stewart-Gough platform or a delta robot. For each
            redundancy parameter (`robot.redundancy`), 16 values are tested.
        R_0_ee: (3, 3) rotation matrix of the tool in the base frame. None means the tool
            orientation at `q_seed`.
        resolution: Number of cells along each side of a cube around the reachable positions. The
            number must be 32 times a power of two.
        q_seed: (n,) actuated coordinates [rad or m] at which the tool position is at or near the
            reachable positions. None means the reference configuration of the robot.

    Returns:
        A `ReachablePositions`. `inside` (nx, ny, nz) is True for each cell whose center is
        reachable. `grid` describes the cells in the base frame [m]. `size` is the volume [m^3] with
        an error bound. `bounds` (2, 3) contains the smallest and largest x, y and z of the
        reachable cells [m].

    Raises:
        MissingFunctionError: The robot has no `ik`. The message lists the robot's other inverse
            kinematics functions.
        InputTypeError: `robot` is not a `Robot`, or `R_0_ee` or `q_seed` contains values that are
            not real numbers.
        ShapeError: `R_0_ee` is not (3, 3), or `q_seed` is not (n,).
        InputValueError: `resolution` is not 32 times a power of two. A number is not finite, or
            `R_0_ee` is not a rotation matrix. `q_seed` is None, and the robot has no reference
            configuration. A redundancy parameter of the robot is a length and has no limits.
        OutOfReachError: No position near the tool position at `q_seed` is reachable, or the loops
            of the robot do not close at `q_seed`.
    """
    check_type("reachable_positions: robot", robot, Robot)
    levels = int(resolution // _COARSE).bit_length() - 1
    if resolution != _COARSE * 2 ** max(levels, 0):
        raise InputValueError(
            f"reachable_positions: resolution must be a power of two times {_COARSE}, got "
            f"{resolution}"
        )
    R, start = _start(robot, R_0_ee, q_seed)
    lower, side, inside = _fitted(robot, R, start)
    for _ in range(levels):
        side /= 2
        open_cells = np.repeat(np.repeat(np.repeat(_border(inside), 2, 0), 2, 1), 2, 2)
        inside = np.repeat(np.repeat(np.repeat(inside, 2, 0), 2, 1), 2, 2)
        cells = np.argwhere(open_cells)
        inside[open_cells] = _reached(robot, R, lower + side * (cells + 0.5))
    nx, ny, nz = inside.shape
    return ReachablePositions(robot.name, R, Grid(lower, side, (nx, ny, nz)), inside)


def _start(
    robot: Robot, R_0_ee: ArrayLike | None, q_seed: ArrayLike | None
) -> tuple[FloatArray, FloatArray]:
    """Return the tool orientation and a start position.

    The start position is at or near a reachable position.
    """
    if q_seed is None and robot.reference is None:
        raise InputValueError(
            "reachable_positions: expected q_seed for a robot without a reference configuration, "
            f"{robot.name}"
        )
    q = robot.reference.q if q_seed is None and robot.reference else q_seed
    T = robot.fk(finite("reachable_positions: q_seed", np.asarray(q), (robot.n,)))
    R = T[:3, :3] if R_0_ee is None else finite("reachable_positions: R_0_ee", R_0_ee, (3, 3))
    return R, T[:3, 3]


def _fitted(robot: Robot, R: FloatArray, start: FloatArray) -> tuple[FloatArray, float, BoolArray]:
    """Return a box around all reached positions: lower corner, cell side, mask of reached cells."""
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
    raise OutOfReachError(f"{robot.name}: found no box around the reached positions near {start}")


def _reached(robot: Robot, R: FloatArray, positions: FloatArray) -> BoolArray:
    """Return a mask (m,) of the positions (m, 3) that the robot reaches."""
    if not len(positions):
        return np.zeros(0, dtype=bool)
    return np.asarray(reach(robot, positions, R[None], progress=False).reached[:, 0])


def _border(inside: BoolArray) -> BoolArray:
    """Return a mask of the cells with a neighbor (of 26) whose reachability differs."""
    padded = np.pad(inside, 1)
    least, most = padded.copy(), padded.copy()
    for axis in range(3):
        pair = [np.roll(least, step, axis) for step in (1, -1)]
        least = least & pair[0] & pair[1]
        pair = [np.roll(most, step, axis) for step in (1, -1)]
        most = most | pair[0] | pair[1]
    return np.asarray((least != most)[1:-1, 1:-1, 1:-1])
