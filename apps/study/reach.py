"""Tests which tool poses a robot reaches, and which coordinate limits exclude the other poses.

The inverse kinematics function `ik` returns the solutions of all branches for each pose. Each
solution is compared with the coordinate limits. For a revolute joint, all values that differ by
full turns are compared with the limits. The function `base_placement` compares several base poses
of a robot.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chasles import InputValueError, Robot, ShapeError, se3
from chasles.contract import check_type
from chasles.summaries import summary_repr
from chasles.tolerances import AT_LIMIT

from .arguments import finite, integer_at_least
from .grid import Grid
from .results import StudyResult
from .samples import BLOCK, box_of
from .streaming import Threads, tallied

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.intp]

FREE, OUT_OF_REACH = -1, -2
_TURN = 2 * math.pi
_BLOCKS_A_PIECE = 16
_MAX_COUNT = 255
"""Largest number of solutions that is stored for a pose. Larger numbers of solutions are replaced
by 255, because the number is stored in one byte."""


@dataclass(frozen=True, eq=False)
class Reach(StudyResult):
    """The tool poses that a robot reaches within its limits, from `reach`.

    Attributes:
        robot: The robot's name.
        coordinate_names: The names of the robot's coordinates.
        n_solutions: (m, k) number of `ik` solutions within limits, for m positions and k
            orientations. Solutions that differ only by full turns of a joint count as one solution.
        limiting_coordinate: (m, k) index of the coordinate that is beyond its limit, in the
            solution that exceeds the limits the least. The index is -1 for a reached pose, and -2
            for a pose that is out of reach even without limits.
        grid: The `Grid` whose cell centers are the tested positions, or None if the argument
            `targets` of `reach` was not a `Grid`.
    """

    _parts = (Grid,)

    robot: str
    coordinate_names: tuple[str, ...]
    n_solutions: NDArray[np.uint8]
    limiting_coordinate: NDArray[np.int8]
    grid: Grid | None = None

    def __repr__(self) -> str:
        """Short summary with the main values."""
        m, k = self.n_solutions.shape
        counts = ", ".join(f"{name} ({n:,})" for name, n in self.limit_counts().items())
        return summary_repr(
            self,
            self.robot,
            f"{m:,} positions x {k} orientations",
            f"{self.reached.mean():.1%} of these poses are reached" if m * k else "",
            f"limits of {counts} exclude others" if counts else "",
            methods="fraction, limit_counts()"
            + (", fraction_grid(), plot()" if self.grid else "")
            + ", save(path)",
        )

    @property
    def reached(self) -> BoolArray:
        """(m, k) mask of the poses with an `ik` solution within limits."""
        return self.n_solutions > 0

    @property
    def fraction(self) -> FloatArray:
        """(m,) fraction of the orientations that are reached at each position."""
        return np.asarray(self.reached.mean(-1))

    def limit_counts(self) -> dict[str, int]:
        """Return the number of poses that each coordinate limit excludes, in descending order."""
        limiting = self.limiting_coordinate[self.limiting_coordinate >= 0]
        counts = np.bincount(limiting, minlength=len(self.coordinate_names))
        order = np.argsort(-counts, kind="stable")
        return {self.coordinate_names[j]: int(counts[j]) for j in order if counts[j]}

    def fraction_grid(self) -> FloatArray:
        """Return the fraction (nx, ny, nz) of the orientations that are reached in each cell.

        Raises:
            InputValueError: The argument `targets` of `reach` was not a `Grid`.
        """
        if self.grid is None:
            raise InputValueError("Reach.fraction_grid: the targets are not a Grid")
        return self.fraction.reshape(self.grid.shape)

    def plot(self, ax: Any = None) -> Any:
        """Plot the fraction of reached orientations, and how many poses each limit excludes.

        Args:
            ax: Three matplotlib axes, or None for a new figure. The first two axes show the cells
                from above and from the side, and the third axes show a bar for each limit.

        Returns:
            The axes.

        Raises:
            InputValueError: The argument `targets` of `reach` was not a `Grid`.
        """
        from .pictures import plot_reach  # noqa: PLC0415

        return plot_reach(self, ax)


def reach(
    robot: Robot,
    targets: Grid | ArrayLike,
    orientations: ArrayLike | None = None,
    *,
    redundancy_samples: int = 16,
    threads: Threads = "all",
    client: Any = None,
    progress: bool | None = None,
) -> Reach:
    """Test which tool poses a robot reaches within its coordinate limits.

    Args:
        robot: A robot with `ik`.
        targets: Positions (m, 3) of the tool origin [m], or tool poses (m, 4, 4), in the base
            frame. A `Grid` means the positions of its cell centers.
        orientations: (k, 3, 3) rotation matrices of the tool in the base frame to test at every
            position. None means `uniform_orientations(20)`. If `targets` contains poses,
            `orientations` must be None.
        redundancy_samples: Number of values to test for each redundancy parameter of `ik`
            (`robot.redundancy`), at least 1. The values of each parameter are evenly spaced within
            its limits, or over one turn. This number has no effect if the robot has no redundancy
            parameter.
        threads: Number of threads in this process or in each worker, or "all" for one thread per
            core.
        client: A `dask.distributed.Client`. The client distributes the poses to its workers. None
            computes in this process.
        progress: Whether to show a progress bar, which needs the package rich. None shows the bar
            only if standard error is a terminal.

    Returns:
        A `Reach` with arrays (m, k), for m positions and k orientations. If `targets` contains
        poses, k is 1. For a `Grid`, m is the number of cells, and z changes fastest in the order of
        the cells. `reached` is True if `ik` has a solution within the limits. `n_solutions` counts
        the `ik` solutions within the limits, up to 255. `limiting_coordinate` is the index of the
        coordinate that exceeds its limit, -1 for a reached pose, and -2 for a pose that is out of
        reach even without limits. `fraction` (m,) is the fraction of the orientations that are
        reached at each position.

    Raises:
        MissingFunctionError: The robot has no `ik`. The message lists the robot's other inverse
            kinematics functions.
        InputTypeError: `robot` is not a `Robot`, or `targets` or `orientations` contains values
            that are not real numbers.
        ShapeError: `targets` is neither (m, 3) nor (m, 4, 4), or `orientations` is not (k, 3, 3).
        InputValueError: A number is not finite, a pose is not a rigid transformation, or an
            orientation is not a rotation matrix. `targets` contains poses, and `orientations` is
            not None. A redundancy parameter of the robot is a length and has no limits. `threads`
            is neither a positive integer nor "all".
    """
    check_type("reach: robot", robot, Robot)
    poses, rotations = _poses_and_rotations(targets, orientations)
    work = _ReachJob(robot, poses, rotations, _redundancy_values(robot, redundancy_samples))
    tally = tallied(
        work, work.pieces, threads=threads, client=client, progress=progress, name=robot.name
    )
    shape = (len(poses), len(rotations))
    return Reach(
        robot.name,
        tuple(coordinate.name for coordinate in robot.coordinates),
        tally.n_solutions.reshape(shape),
        tally.limiting.reshape(shape),
        targets if isinstance(targets, Grid) else None,
    )


def base_placement(
    robot: Robot,
    T_w_ee: ArrayLike,
    T_w_0: ArrayLike,
    *,
    threads: Threads = "all",
    client: Any = None,
    progress: bool | None = None,
) -> FloatArray:
    """Return the fraction of required tool poses that a robot reaches from each base pose.

    Args:
        robot: A robot with `ik`. For each redundancy parameter (`robot.redundancy`), 16 values are
            tested.
        T_w_ee: (k, 4, 4) required tool poses in the world frame, with positions in [m].
        T_w_0: (m, 4, 4) base poses to compare, in the world frame, with positions in [m].
        threads: Number of threads in this process or in each worker, or "all" for one thread per
            core.
        client: A `dask.distributed.Client`. The client distributes the poses to its workers. None
            computes in this process.
        progress: Whether to show a progress bar, which needs the package rich. None shows the bar
            only if standard error is a terminal.

    Returns:
        (m,) fractions of the required poses that `ik` reaches within the coordinate limits, from 0
        to 1. An unreachable pose raises no error.

    Raises:
        MissingFunctionError: The robot has no `ik`. The message lists the robot's other inverse
            kinematics functions.
        InputTypeError: `robot` is not a `Robot`, or a pose contains values that are not real
            numbers.
        ShapeError: `T_w_ee` is not (k, 4, 4), or `T_w_0` is not (m, 4, 4).
        InputValueError: A number is not finite, or a pose is not a rigid transformation. A
            redundancy parameter of the robot is a length and has no limits. `threads` is neither a
            positive integer nor "all".
    """
    check_type("base_placement: robot", robot, Robot)
    tools, bases = finite("T_w_ee", T_w_ee), finite("T_w_0", T_w_0)
    for name, array in (("T_w_ee", tools), ("T_w_0", bases)):
        if array.ndim != 3 or array.shape[1:] != (4, 4):  # noqa: PLR2004 - the rows are matrices
            raise ShapeError(f"{name}: expected shape (m, 4, 4), got {array.shape}")
    T_0_ee = np.matmul(se3.inverse(bases)[:, None], tools)
    found = reach(
        robot, T_0_ee.reshape(-1, 4, 4), threads=threads, client=client, progress=progress
    )
    return np.asarray(found.reached.reshape(len(bases), -1).mean(-1))


def uniform_orientations(count: int) -> FloatArray:
    """Return evenly distributed rotation matrices, with z axes on a golden-angle spiral.

    Args:
        count: Number of orientations, at least 1.

    Returns:
        (count, 3, 3) rotation matrices. The last column of each matrix is the z axis of the tool.
        The returned matrices depend only on `count`.

    Raises:
        InputTypeError: `count` is not a real number.
        ShapeError: `count` is an array with one or more dimensions.
        InputValueError: `count` is less than 1 or has a fractional part.

    Source:
        R. Swinbank, R. J. Purser, Fibonacci grids: a novel approach to global modelling, 2006.
    """
    k = np.arange(integer_at_least("uniform_orientations: count", count, 1))
    golden = np.pi * (3 - math.sqrt(5))
    tilt, azimuth = np.arccos(1 - (2 * k + 1) / count), golden * k
    return np.asarray(_about_z(azimuth) @ _about_y(tilt) @ _about_z(azimuth))


def _about_z(angle: Any) -> FloatArray:
    c, s, o, i = np.cos(angle), np.sin(angle), 0 * angle, 0 * angle + 1
    return np.moveaxis(np.array([[c, -s, o], [s, c, o], [o, o, i]]), -1, 0)


def _about_y(angle: Any) -> FloatArray:
    c, s, o, i = np.cos(angle), np.sin(angle), 0 * angle, 0 * angle + 1
    return np.moveaxis(np.array([[c, o, s], [o, i, o], [-s, o, c]]), -1, 0)


def _poses_and_rotations(
    targets: Grid | ArrayLike, orientations: ArrayLike | None
) -> tuple[FloatArray, FloatArray]:
    """Return poses (m, 4, 4), and rotation matrices (k, 3, 3) to apply to each pose."""
    if isinstance(targets, Grid):
        mesh = np.meshgrid(*targets.centers(), indexing="ij")
        at: FloatArray = np.stack(mesh, -1).reshape(-1, 3)
    else:
        at = finite("targets", targets)
    if at.ndim == 3 and at.shape[1:] == (4, 4):  # noqa: PLR2004 - the rows are matrices
        if orientations is not None:
            raise InputValueError("reach: orientations= requires positions, but targets are poses")
        return at, np.eye(3)[None]
    if at.ndim != 2 or at.shape[1] != 3:  # noqa: PLR2004 - the rows are positions
        raise ShapeError(f"targets: expected a Grid, (m, 3) or (m, 4, 4), got shape {at.shape}")
    rotations = uniform_orientations(20) if orientations is None else orientations
    rotations = finite("orientations", rotations)
    if rotations.ndim != 3 or rotations.shape[1:] != (3, 3):  # noqa: PLR2004 - the rows are matrices
        raise ShapeError(f"orientations: expected (k, 3, 3), got shape {rotations.shape}")
    poses = np.tile(np.eye(4), (len(at), 1, 1))
    poses[:, :3, 3] = at
    return poses, rotations


def _redundancy_values(robot: Robot, count: int) -> FloatArray:
    """Return values (k, r) of r redundancy parameters, or an empty array (1, 0) if r is 0."""
    values = []
    for item in robot.redundancy:
        if item.index is not None:
            lower, upper = box_of(robot)
            values.append(np.linspace(lower[item.index], upper[item.index], count))
        elif item.unit == "rad":
            values.append(np.arange(count) * (_TURN / count) - math.pi)
        else:
            raise InputValueError(
                f"{robot.name}: expected limits of all redundancy parameters of ik, got none for "
                f"{item.name} ({item.meaning})"
            )
    if not values:
        return np.empty((1, 0))
    return np.stack(np.meshgrid(*values, indexing="ij"), -1).reshape(-1, len(values))


class _Tally:
    """Number of solutions and index of the limiting coordinate for each pose.

    The tally of one piece of the pose list contains zeros for the poses of the other pieces.
    """

    def __init__(self, count: int) -> None:
        self.n_solutions = np.zeros(count, dtype=np.uint8)
        self.limiting = np.zeros(count, dtype=np.int8)

    def merge(self, other: _Tally) -> None:
        self.n_solutions += other.n_solutions
        self.limiting += other.limiting


@dataclass(frozen=True, eq=False)
class _ReachJob:
    robot: Robot
    poses: FloatArray
    rotations: FloatArray
    redundancy: FloatArray

    @property
    def count(self) -> int:
        return len(self.poses) * len(self.rotations)

    @property
    def pieces(self) -> int:
        return -(-self.count // (BLOCK * _BLOCKS_A_PIECE))

    def empty(self) -> _Tally:
        return _Tally(self.count)

    def add(self, tally: _Tally, piece: int) -> None:
        size = BLOCK * _BLOCKS_A_PIECE
        end = min((piece + 1) * size, self.count)
        for begin in range(piece * size, end, BLOCK):
            some = slice(begin, min(begin + BLOCK, end))
            pose, rotation = np.divmod(np.arange(some.start, some.stop), len(self.rotations))
            T = self.poses[pose]
            T[:, :3, :3] = T[:, :3, :3] @ self.rotations[rotation]
            names = [item.name for item in self.robot.redundancy]
            found = [
                _counted(self.robot, self.robot.ik(T, fixed=dict(zip(names, row, strict=True))))
                for row in self.redundancy
            ]
            solutions, limiting = (np.array(column) for column in zip(*found, strict=True))
            tally.n_solutions[some] = np.minimum(solutions.sum(0), _MAX_COUNT)
            # Coordinate indices are larger than OUT_OF_REACH, so `limiting.max(0)` is a coordinate
            # index if a coordinate limits the pose at any redundancy value.
            tally.limiting[some] = np.where(solutions.any(0), FREE, limiting.max(0))


def _counted(robot: Robot, found: Any) -> tuple[IntArray, IntArray]:
    """Return, for each pose, the number of solutions within limits and the limiting coordinate."""
    inside = found.valid.copy()
    for j, wraps in enumerate(found.wraps):
        if np.isfinite(_room(robot, j, wraps)):
            inside &= _excess(robot, found.q[..., j], j, wraps) <= AT_LIMIT * found.unit_length
    count = inside.sum(-1)
    limiting = np.where(count > 0, FREE, OUT_OF_REACH)
    exceeding = (count == 0) & found.valid.any(-1)
    if exceeding.any():
        limiting[exceeding] = _limit(robot, found.q[exceeding], found.valid[exceeding], found.wraps)
    return count, limiting


def _room(robot: Robot, j: int, wraps: bool) -> float:
    """Return the width of a coordinate's range [rad or m].

    The returned width is inf if `wraps` is true and the range is at least a full turn.
    """
    room = float(robot.upper[j] - robot.lower[j])
    return math.inf if wraps and room >= _TURN else room


def _excess(robot: Robot, q: FloatArray, j: int, wraps: bool) -> FloatArray:
    """Return how far joint values are outside the limits, modulo full turns if `wraps` is true."""
    lower, upper = robot.lower[j], robot.upper[j]
    if not wraps or not np.isfinite(upper - lower):
        return np.asarray(np.maximum(np.maximum(lower - q, q - upper), 0))
    above = np.mod(q - lower, _TURN)
    return np.asarray(
        np.where(above <= upper - lower, 0, np.minimum(above - upper + lower, _TURN - above))
    )


def _limit(robot: Robot, q: FloatArray, valid: BoolArray, wraps: tuple[bool, ...]) -> IntArray:
    """Return the coordinate most beyond its limit in the solution closest to the limits."""
    parts = np.zeros(q.shape)
    for j, wrap in enumerate(wraps):
        room = _room(robot, j, wrap)
        if np.isfinite(room) and room > 0:
            parts[..., j] = _excess(robot, q[..., j], j, wrap) / room
    worst = np.where(valid, parts.max(-1), np.inf)
    branch = worst.argmin(-1)
    return np.asarray(parts[np.arange(len(q)), branch].argmax(-1))
