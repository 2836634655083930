"""Reach: the poses that a robot has solutions for, and the limits that stop it elsewhere.

Every pose is put through the robot's inverse with all branches, and the solutions are held against
the limits, each turning joint at every turn. Base placement is the same question with the poses
seen from other bases.
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chasles import InputValueError, Robot, ShapeError, screws
from chasles.summaries import summary_repr
from chasles.tolerances import AT_LIMIT

from .arguments import finite, whole
from .cells import Cells
from .samples import BLOCK, box_of
from .streaming import Threads, tallied

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.intp]

FREE, OUT_OF_REACH = -1, -2
_TURN = 2 * math.pi
_BLOCKS_A_PIECE = 16
_MOST = 255
"""The largest count that is kept, in a byte a pose."""


@dataclass(frozen=True, eq=False)
class Reach:
    """Which poses a robot reaches within its limits.

    Attributes:
        robot: The robot's name.
        joints: The names of its coordinates.
        solutions: (m, k) number of solutions within limits, for m places and k orientations; turns
            of a joint are not counted apart.
        stopped: (m, k) the coordinate whose limit forbids the solution that exceeds its limits
            least; -1 where the pose is reached, -2 where it is out of reach without limits.
        cells: The cells whose centres the places are; None where places were given.
    """

    robot: str
    joints: tuple[str, ...]
    solutions: NDArray[np.uint8]
    stopped: NDArray[np.int8]
    cells: Cells | None = None

    def __repr__(self) -> str:
        """In words, with the figures that matter."""
        places, turns = self.solutions.shape
        stops = ", ".join(f"{name} ({n:,})" for name, n in self.stopped_by().items())
        return summary_repr(
            self,
            self.robot,
            f"{places:,} places x {turns} orientations",
            f"{self.reached.mean():.1%} of these poses are reached" if self.solutions.size else "",
            f"the limits of {stops} stop others" if stops else "",
            methods="share, stopped_by()"
            + (", grid(), plot()" if self.cells else "")
            + ", to_npz(path)",
        )

    @property
    def reached(self) -> BoolArray:
        """(m, k) whether there is a solution within limits."""
        return self.solutions > 0

    @property
    def share(self) -> FloatArray:
        """(m,) part of the orientations that are reached at each place."""
        return np.asarray(self.reached.mean(-1))

    def stopped_by(self) -> dict[str, int]:
        """How many poses the limit of each coordinate stops, the most frequent first."""
        counts = np.bincount(self.stopped[self.stopped >= 0], minlength=len(self.joints))
        order = np.argsort(-counts, kind="stable")
        return {self.joints[j]: int(counts[j]) for j in order if counts[j]}

    def grid(self) -> FloatArray:
        """(nx, ny, nz) part of the orientations that are reached in each cell.

        Raises:
            InputValueError: The places are no cells.
        """
        if self.cells is None:
            raise InputValueError("Reach.grid: the places were given one by one, not as Cells")
        return self.share.reshape(self.cells.shape)

    def plot(self, ax: Any = None) -> Any:
        """Draws the part of the orientations that are reached, and which limits stop the others.

        Args:
            ax: Three matplotlib axes: cells seen from above and from the side, and the limits;
                None: a new figure.

        Returns:
            The axes.

        Raises:
            InputValueError: The places are no cells.
        """
        from .pictures import plot_reach  # noqa: PLC0415

        return plot_reach(self, ax)

    def to_npz(self, path: str | os.PathLike[str]) -> None:
        """Writes counts and limits to a compressed file that NumPy reads."""
        arrays: dict[str, Any] = {"solutions": self.solutions, "stopped": self.stopped}
        if self.cells is not None:
            arrays |= {
                "lower": self.cells.lower,
                "side": self.cells.side,
                "shape": self.cells.shape,
            }
        np.savez_compressed(Path(path), joints=np.array(self.joints), **arrays)


def reach(
    robot: Robot,
    places: Cells | ArrayLike,
    orientations: ArrayLike | None = None,
    *,
    given: int = 16,
    threads: Threads = "all",
    client: Any = None,
    progress: bool | None = None,
) -> Reach:
    """Which poses have solutions within limits, on all branches.

    Args:
        robot: A robot with `ik`.
        places: Cells, whose centres are meant; (m, 3) positions of the tool's origin [m]; or
            (m, 4, 4) poses.
        orientations: (k, 3, 3) rotation matrices that the tool has at every place, `evenly(20)` if
            None; poses have their own.
        given: For an inverse with given joints, the number of values of each of them, spread over
            its limits; solutions are counted for all values.
        threads: Threads here, or in each worker; "all": one per core.
        client: A `dask.distributed.Client`, whose workers share the poses.
        progress: Whether to draw a bar; None: on a terminal.

    Returns:
        Solutions and the limits that stop the others.

    Raises:
        AttributeError: The robot has no `ik`; the message says what it has instead.
        ShapeError: Places or orientations have another shape.
        InputValueError: A number is not finite, or poses come with further orientations.
    """
    poses, turns = _asked(places, orientations)
    work = _Asking(robot, poses, turns, _given_values(robot, given))
    tally = tallied(
        work, work.pieces, threads=threads, client=client, progress=progress, name=robot.name
    )
    shape = (len(poses), len(turns))
    return Reach(
        robot.name,
        tuple(coordinate.name for coordinate in robot.coordinates),
        tally.solutions.reshape(shape),
        tally.stopped.reshape(shape),
        places if isinstance(places, Cells) else None,
    )


def base_placement(
    robot: Robot,
    poses: ArrayLike,
    bases: ArrayLike,
    *,
    threads: Threads = "all",
    client: Any = None,
    progress: bool | None = None,
) -> FloatArray:
    """The part of a set of poses that a robot reaches from each of many places to stand.

    Args:
        robot: A robot with `ik`.
        poses: (k, 4, 4) `T_w_ee`, poses of the tool in the world that shall be reached.
        bases: (m, 4, 4) `T_w_0`, poses of the robot's base.
        threads: Threads here, or in each worker; "all": one per core.
        client: A `dask.distributed.Client`, whose workers share the poses.
        progress: Whether to draw a bar; None: on a terminal.

    Returns:
        (m,) parts of the poses that have a solution within limits; the best base is the argmax.

    Raises:
        AttributeError: The robot has no `ik`.
        ShapeError: Poses or bases have another shape.
        InputValueError: A number is not finite.
    """
    T_w_ee, T_w_0 = finite("poses", poses), finite("bases", bases)
    for name, array in (("poses", T_w_ee), ("bases", T_w_0)):
        if array.ndim != 3 or array.shape[1:] != (4, 4):  # noqa: PLR2004 - rows of matrices
            raise ShapeError(f"{name}: expected shape (m, 4, 4), got {array.shape}")
    T_0_ee = np.matmul(screws.inverse(T_w_0)[:, None], T_w_ee)
    found = reach(
        robot, T_0_ee.reshape(-1, 4, 4), threads=threads, client=client, progress=progress
    )
    return np.asarray(found.reached.reshape(len(T_w_0), -1).mean(-1))


def evenly(count: int) -> FloatArray:
    """Orientations spread evenly: a spiral of directions for z, turned by the golden angle.

    Args:
        count: Their number, at least 1.

    Raises:
        InputValueError: The count is less than 1.

    Returns:
        (count, 3, 3) rotation matrices.

    Source:
        R. Swinbank, R. J. Purser, Fibonacci grids: a novel approach to global modelling, 2006.
    """
    k = np.arange(whole("evenly: count", count, 1))
    golden = np.pi * (3 - math.sqrt(5))
    tilt, azimuth = np.arccos(1 - (2 * k + 1) / count), golden * k
    return np.asarray(_about_z(azimuth) @ _about_y(tilt) @ _about_z(azimuth))


def _about_z(angle: Any) -> FloatArray:
    c, s, o, i = np.cos(angle), np.sin(angle), 0 * angle, 0 * angle + 1
    return np.moveaxis(np.array([[c, -s, o], [s, c, o], [o, o, i]]), -1, 0)


def _about_y(angle: Any) -> FloatArray:
    c, s, o, i = np.cos(angle), np.sin(angle), 0 * angle, 0 * angle + 1
    return np.moveaxis(np.array([[c, o, s], [o, i, o], [-s, o, c]]), -1, 0)


def _asked(
    places: Cells | ArrayLike, orientations: ArrayLike | None
) -> tuple[FloatArray, FloatArray]:
    """Poses (m, 4, 4) without turns, and the turns (k, 3, 3) that each of them gets."""
    if isinstance(places, Cells):
        grid = np.meshgrid(*places.centres(), indexing="ij")
        at: FloatArray = np.stack(grid, -1).reshape(-1, 3)
    else:
        at = finite("places", places)
    if at.ndim == 3 and at.shape[1:] == (4, 4):  # noqa: PLR2004 - rows of matrices
        if orientations is not None:
            raise InputValueError("reach: poses have their own orientations; expected positions")
        return at, np.eye(3)[None]
    if at.ndim != 2 or at.shape[1] != 3:  # noqa: PLR2004 - rows of positions
        raise ShapeError(f"places: expected Cells, (m, 3) or (m, 4, 4), got shape {at.shape}")
    turns = evenly(20) if orientations is None else finite("orientations", orientations)
    if turns.ndim != 3 or turns.shape[1:] != (3, 3):  # noqa: PLR2004 - rows of matrices
        raise ShapeError(f"orientations: expected (k, 3, 3), got shape {turns.shape}")
    poses = np.tile(np.eye(4), (len(at), 1, 1))
    poses[:, :3, 3] = at
    return poses, turns


def _given_values(robot: Robot, count: int) -> FloatArray:
    """(k, r) values of the given joints of `ik`; one row without columns where there are none."""
    values = []
    for item in robot.redundancy:
        if item.index is not None:
            lower, upper = box_of(robot)
            values.append(np.linspace(lower[item.index], upper[item.index], count))
        elif item.unit == "rad":
            values.append(np.arange(count) * (_TURN / count) - math.pi)
        else:
            raise InputValueError(
                f"{robot.name}: ik takes {item.name} ({item.meaning}), whose range is not known"
            )
    if not values:
        return np.empty((1, 0))
    return np.stack(np.meshgrid(*values, indexing="ij"), -1).reshape(-1, len(values))


class _Answers:
    """Answers by pose; every pose is asked once, so that tallies add up."""

    def __init__(self, count: int) -> None:
        self.solutions = np.zeros(count, dtype=np.uint8)
        self.stopped = np.zeros(count, dtype=np.int8)

    def merge(self, other: _Answers) -> None:
        self.solutions += other.solutions
        self.stopped += other.stopped


@dataclass(frozen=True, eq=False)
class _Asking:
    robot: Robot
    poses: FloatArray
    turns: FloatArray
    given: FloatArray

    @property
    def count(self) -> int:
        return len(self.poses) * len(self.turns)

    @property
    def pieces(self) -> int:
        return -(-self.count // (BLOCK * _BLOCKS_A_PIECE))

    def empty(self) -> _Answers:
        return _Answers(self.count)

    def add(self, tally: _Answers, piece: int) -> None:
        size = BLOCK * _BLOCKS_A_PIECE
        end = min((piece + 1) * size, self.count)
        for begin in range(piece * size, end, BLOCK):
            some = slice(begin, min(begin + BLOCK, end))
            place, turn = np.divmod(np.arange(some.start, some.stop), len(self.turns))
            T = self.poses[place]
            T[:, :3, :3] = T[:, :3, :3] @ self.turns[turn]
            names = [item.name for item in self.robot.redundancy]
            answers = [
                _answers(self.robot, self.robot.ik(T, fixed=dict(zip(names, row, strict=True))))
                for row in self.given
            ]
            solutions, stopped = (np.array(column) for column in zip(*answers, strict=True))
            tally.solutions[some] = np.minimum(solutions.sum(0), _MOST)
            # The largest code is the most hopeful one: a limit stands before "out of reach".
            tally.stopped[some] = np.where(solutions.any(0), FREE, stopped.max(0))


def _answers(robot: Robot, found: Any) -> tuple[IntArray, IntArray]:
    """Solutions within limits of each pose, and what stops it."""
    inside = found.valid.copy()
    for j, wraps in enumerate(found.wraps):
        if np.isfinite(_room(robot, j, wraps)):
            inside &= _excess(robot, found.q[..., j], j, wraps) <= AT_LIMIT * found.unit
    count = inside.sum(-1)
    stopped = np.where(count > 0, FREE, OUT_OF_REACH)
    exceeding = (count == 0) & found.valid.any(-1)
    if exceeding.any():
        stopped[exceeding] = _limit(robot, found.q[exceeding], found.valid[exceeding], found.wraps)
    return count, stopped


def _room(robot: Robot, j: int, wraps: bool) -> float:
    """The range of a coordinate [rad or m]; inf where no value of it can exceed a limit."""
    room = float(robot.upper[j] - robot.lower[j])
    return math.inf if wraps and room >= _TURN else room


def _excess(robot: Robot, q: FloatArray, j: int, wraps: bool) -> FloatArray:
    """How far values are from the range of a coordinate, at the turn that is nearest to it."""
    lower, upper = robot.lower[j], robot.upper[j]
    if not wraps or not np.isfinite(upper - lower):
        return np.asarray(np.maximum(np.maximum(lower - q, q - upper), 0))
    above = np.mod(q - lower, _TURN)
    return np.asarray(
        np.where(above <= upper - lower, 0, np.minimum(above - upper + lower, _TURN - above))
    )


def _limit(robot: Robot, q: FloatArray, valid: BoolArray, wraps: tuple[bool, ...]) -> IntArray:
    """The coordinate that exceeds its range most, of the branch where that is least."""
    parts = np.zeros(q.shape)
    for j, wrap in enumerate(wraps):
        room = _room(robot, j, wrap)
        if np.isfinite(room) and room > 0:
            parts[..., j] = _excess(robot, q[..., j], j, wrap) / room
    worst = np.where(valid, parts.max(-1), np.inf)
    branch = worst.argmin(-1)
    return np.asarray(parts[np.arange(len(q)), branch].argmax(-1))
