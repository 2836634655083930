"""Workspace: the places that a tool reaches, in how many ways, and how well.

Postures that fill the box of the coordinates are put through the robot's forward kinematics; each
adds to the cell in which the tool's origin lies. Nothing else is kept, so a billion postures need
no more memory than a thousand.
"""

from __future__ import annotations

import json
import os
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from chasles import InputValueError, Robot
from chasles.summaries import ranges, summary_repr

from .arguments import finite
from .cells import Cells, Measure, cells_of, measure_of
from .extents import extents_of
from .samples import By, Samples, samples_of
from .streaming import Threads, tallied

FloatArray = NDArray[np.float64]
Quality = Literal["manipulability", "limit_margin", "directions"]

_DIRECTIONS = 64
"""Directions of the tool's z axis that are told apart: one for each digit of a word."""
_SIDE = 8
_FORMAT = 1


@dataclass(frozen=True, eq=False)
class Workspace:
    """What a tool reaches.

    Attributes:
        robot: The robot's name.
        cells: The box of cells.
        hits: (nx, ny, nz) number of postures that put the tool's origin into each cell.
        manipulability: (nx, ny, nz) the largest smallest singular value of the Jacobian in each
            cell (`Manipulability.min_singular_value`), 0 in cells without a posture; None if not
            requested.
        limit_margin: (nx, ny, nz) the largest distance from the nearest limit, in parts of the
            range of that coordinate: 1/2 in the middle; 0 where no posture lies; None if not asked
            for.
        directions: (nx, ny, nz) how many of 64 equal sectors of the sphere the tool's z axis points
            into; None if not asked for.
        extents: (2, 3) least and largest coordinates of the tool's origin [m], by optimisation.
        samples: Number of postures.
        lost: Number of postures at which loops do not close.
        by: How the postures fill the box.
        key: The key of their random numbers.
    """

    robot: str
    cells: Cells
    hits: NDArray[np.uint32]
    manipulability: NDArray[np.float32] | None
    limit_margin: NDArray[np.float32] | None
    directions: NDArray[np.uint8] | None
    extents: FloatArray
    samples: int
    lost: int
    by: By
    key: int

    def __repr__(self) -> str:
        """In words, with the figures that matter."""
        lost = f"loops open at {self.lost:,}" if self.lost else ""
        shape = " x ".join(map(str, self.cells.shape))
        qualities = [name for name in get_args(Quality) if getattr(self, name) is not None]
        return summary_repr(
            self,
            self.robot,
            f"{self.samples:,} postures by {self.by}",
            lost,
            ranges(self.extents),
            str(self.measure),
            f"{shape} cells of {self.cells.side:.4g} m",
            f"with {', '.join(qualities)}" if qualities else "",
            methods="section(axis, at), projection(axis), plot(), to_npz(path)",
        )

    @property
    def measure(self) -> Measure:
        """Volume [m^3], of a flat workspace area [m^2], of a straight one length [m]."""
        return measure_of(self.cells, self.hits)

    def section(self, axis: Literal["x", "y", "z"], at: float) -> NDArray[np.uint32]:
        """The hits in the layer of cells at a coordinate.

        Args:
            axis: The axis normal to the section.
            at: The coordinate [m].

        Returns:
            (n, m) hits; the remaining axes in their order.

        Raises:
            InputValueError: There is no such axis, or the coordinate is outside the cells.
        """
        k = _axis("section", axis)
        layer = int(np.floor((finite("section: at", at) - self.cells.lower[k]) / self.cells.side))
        if not 0 <= layer < self.cells.shape[k]:
            raise InputValueError(
                f"{axis} = {at:g} m is outside the workspace: expected {self.cells.lower[k]:.4g} "
                f"to {self.cells.upper[k]:.4g} m"
            )
        return np.asarray(np.take(self.hits, layer, axis=k))

    def projection(self, axis: Literal["x", "y", "z"]) -> NDArray[np.uint64]:
        """The sum of the hits along an axis: (n, m), the remaining axes in their order.

        Raises:
            InputValueError: There is no such axis.
        """
        return np.asarray(self.hits.sum(_axis("projection", axis), dtype=np.uint64))

    def plot(self, ax: Any = None) -> Any:
        """Draws the workspace seen from above and from the side; a flat one in its plane.

        Args:
            ax: The matplotlib axes of a single view, normal to the thinnest direction; None: a new
                figure with both views.

        Returns:
            The axes, or the array of them.
        """
        from .pictures import plot_workspace  # noqa: PLC0415

        return plot_workspace(self, ax)

    def to_npz(self, path: str | os.PathLike[str]) -> None:
        """Writes all data to a compressed file that `from_npz` and NumPy read."""
        given = {
            name: array for name in get_args(Quality) if (array := getattr(self, name)) is not None
        }
        facts = {
            "format": _FORMAT,
            "robot": self.robot,
            "samples": self.samples,
            "lost": self.lost,
            "by": self.by,
            "key": self.key,
            "side": self.cells.side,
        }
        np.savez_compressed(
            Path(path),
            facts=np.array(json.dumps(facts)),
            lower=self.cells.lower,
            extents=self.extents,
            hits=self.hits,
            **given,
        )

    @classmethod
    def from_npz(cls, path: str | os.PathLike[str]) -> Workspace:
        """The workspace that `to_npz` wrote.

        Raises:
            InputValueError: The file holds something else.
        """
        with np.load(Path(path)) as file:
            if (
                "facts" not in file
                or (facts := json.loads(str(file["facts"])))["format"] != _FORMAT
            ):
                raise InputValueError(f"{path}: expected a workspace, as to_npz writes it")
            hits = file["hits"]
            nx, ny, nz = hits.shape
            return cls(
                robot=facts["robot"],
                cells=Cells(file["lower"], facts["side"], (nx, ny, nz)),
                hits=hits,
                extents=file["extents"],
                samples=facts["samples"],
                lost=facts["lost"],
                by=facts["by"],
                key=facts["key"],
                **{name: file.get(name) for name in get_args(Quality)},
            )


def workspace(
    robot: Robot,
    samples: int = 10_000_000,
    *,
    by: By = "sobol",
    finest: int = 100,
    quality: Collection[Quality] = (),
    key: int = 0,
    threads: Threads = "all",
    client: Any = None,
    progress: bool | None = None,
) -> Workspace:
    """The workspace of a robot within its limits.

    Args:
        robot: The robot; one with loops counts the postures at which they close.
        samples: Number of postures.
        by: "sobol", "uniform" or "grid", as in `Samples`.
        finest: Number of cells along the longest side.
        quality: What is found in each cell besides the number of postures.
        key: Chooses the random numbers; the same key gives the same bits, for any number of
            threads and workers.
        threads: Threads here, or in each worker; "all": one per core.
        client: A `dask.distributed.Client`, whose workers share the postures; None: this process.
        progress: Whether to draw a bar; None: on a terminal.

    Raises:
        InputValueError: A slider has no limits, no posture closes the loops, or an argument is not
            one of those expected.
    """
    unknown = set(quality) - set(get_args(Quality))
    if unknown or finest < 2:  # noqa: PLR2004 - a side has two ends
        raise InputValueError(
            f"workspace: expected quality out of {', '.join(get_args(Quality))} and finest >= 2, "
            f"got {', '.join(map(str, quality)) or 'no quality'} and {finest}"
        )
    points = samples_of(robot, samples, by, key)
    extents = extents_of(robot, points)
    cells = cells_of(extents[0], extents[1], finest)
    work = _Visits(robot, points, cells, frozenset(quality))
    tally = tallied(
        work, points.pieces, threads=threads, client=client, progress=progress, name=robot.name
    )
    return _workspace(work, tally, extents)


class _Counts:
    """What each cell has seen; the last cell takes postures at which loops do not close."""

    def __init__(self, cells: int, quality: frozenset[Quality]) -> None:
        self.hits = np.zeros(cells + 1, dtype=np.uint32)
        self.best = {
            name: np.zeros(cells + 1, dtype=np.float32) for name in quality if name != "directions"
        }
        directions = "directions" in quality
        self.sectors = np.zeros(cells + 1, dtype=np.uint64) if directions else None

    def merge(self, other: _Counts) -> None:
        self.hits += other.hits
        for name, own in self.best.items():
            np.maximum(own, other.best[name], out=own)
        if self.sectors is not None and other.sectors is not None:
            self.sectors |= other.sectors


@dataclass(frozen=True, eq=False)
class _Visits:
    robot: Robot
    points: Samples
    cells: Cells
    quality: frozenset[Quality]

    def empty(self) -> _Counts:
        return _Counts(self.cells.count, self.quality)

    def add(self, tally: _Counts, piece: int) -> None:
        for q in self.points.blocks(piece):
            T = self.robot.fk(q)
            cell = self.cells.index(T[:, :3, 3])
            np.add.at(tally.hits, cell, np.uint32(1))
            if "manipulability" in tally.best:
                smallest = self.robot.manipulability(q).min_singular_value.astype(np.float32)
                np.fmax.at(tally.best["manipulability"], cell, smallest)
            if "limit_margin" in tally.best:
                margin = _limit_margin(q, self.points).astype(np.float32)
                np.maximum.at(tally.best["limit_margin"], cell, margin)
            if tally.sectors is not None:
                np.bitwise_or.at(tally.sectors, cell, np.uint64(1) << _sector(T[:, :3, 2]))


def _limit_margin(q: FloatArray, points: Samples) -> FloatArray:
    span = np.where(points.upper > points.lower, points.upper - points.lower, 1)
    return np.asarray((np.minimum(q - points.lower, points.upper - q) / span).min(-1))


def _sector(z: FloatArray) -> NDArray[np.uint64]:
    """The sector of a direction: 8 belts of equal height, which have equal areas, by 8 meridians.

    Args:
        z: (m, 3) unit vectors; NaN belongs to sector 0.
    """
    belt = np.clip(np.nan_to_num((z[:, 2] + 1) * (_SIDE / 2)), 0, _SIDE - 1).astype(np.uint64)
    turn = np.arctan2(z[:, 1], z[:, 0]) * (_SIDE / (2 * np.pi)) + _SIDE / 2
    meridian = np.clip(np.nan_to_num(turn), 0, _SIDE - 1).astype(np.uint64)
    return belt * np.uint64(_SIDE) + meridian


def _workspace(work: _Visits, tally: _Counts, extents: FloatArray) -> Workspace:
    shape, points = work.cells.shape, work.points
    best = {name: tally.best[name][:-1].reshape(shape) for name in tally.best}
    sectors = tally.sectors
    directions = None if sectors is None else np.bitwise_count(sectors[:-1]).reshape(shape)
    return Workspace(
        robot=work.robot.name,
        cells=work.cells,
        hits=tally.hits[:-1].reshape(shape),
        manipulability=best.get("manipulability"),
        limit_margin=best.get("limit_margin"),
        directions=directions,
        extents=extents,
        samples=points.count,
        lost=int(tally.hits[-1]),
        by=points.by,
        key=points.key,
    )


def _axis(method: str, name: str) -> int:
    if name not in ("x", "y", "z"):
        raise InputValueError(f"{method}: expected axis x, y or z, got {name!r}")
    return "xyz".index(name)
