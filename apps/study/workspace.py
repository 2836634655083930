"""Computes the positions that a tool reaches.

Each cell of a position grid stores the number and quality of the configurations whose tool origin
is in the cell.

Configurations are sampled between the lower and upper bound of each coordinate. For each
configuration, forward kinematics determines the grid cell that contains the tool origin, and the
count of this cell increases by 1. The configurations are not stored, so the required memory does
not depend on the number of configurations.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from chasles import InputValueError, Robot
from chasles.contract import check_type, requires
from chasles.summaries import summary_repr

from .arguments import Rng, finite, integer_at_least, key_of
from .grid import Grid, SizeEstimate, indices, size_of
from .results import StudyResult, ranges
from .samples import Samples, Sampling, samples_of
from .streaming import Threads, tallied

_STARTS = 8
"""Number of start configurations of the optimization for each bound of the tool position."""
_CALLS = 1000
"""Maximum number of function evaluations in an optimization."""
_STEP = 1e-12
"""An optimization stops below this step length, relative to the coordinate ranges."""
_SLOPE = 1e-14
"""An optimization stops if the gradient is below this value, for coordinates that are divided by
their ranges."""
FloatArray = NDArray[np.float64]
Quality = Literal["manipulability", "limit_margin", "directions"]

_PATH_POINTS = 10_001
"""Number of points on the tool path of a robot with one coordinate. The sum of the distances
between adjacent points is the path length."""
_SIDE = 8
"""A sphere of directions is divided into this number of latitude zones, and each zone into this
number of longitude sectors."""


@dataclass(frozen=True, eq=False)
class Workspace(StudyResult):
    """The tool positions that a robot reaches within its limits, from sampled configurations.

    Attributes:
        robot: The robot's name.
        grid: The grid of cells, in the base frame.
        hits: (nx, ny, nz) number of configurations with the tool origin in each cell.
        manipulability: (nx, ny, nz) largest manipulability among the configurations in each cell,
            or 0 without hits. The manipulability is the minimum singular value of the Jacobian
            (`Manipulability.min_singular_value`). `manipulability` is None if the argument
            `quality` of `workspace` does not contain "manipulability".
        limit_margin: (nx, ny, nz) largest limit margin among the configurations in each cell, or 0
            in cells without configurations. The limit margin is the distance to the nearest limit,
            relative to the coordinate's range (at most 1/2). `limit_margin` is None if the argument
            `quality` of `workspace` does not contain "limit_margin".
        directions: (nx, ny, nz) number of sectors that the tool's z axis reaches, among 64 equal
            sectors of the sphere of directions. `directions` is None if the argument `quality` of
            `workspace` does not contain "directions".
        bounds: (2, 3) smallest and largest coordinates of the tool origin [m], found by
            optimization.
        samples: Number of sampled configurations.
        n_open: Number of sampled configurations at which loops do not close.
        sampling: Sampling method: "sobol", "uniform" or "grid".
        rng: Seed that reproduces the configurations.
        path_length: Length [m] of the tool path of a robot with one coordinate, with an error
            estimate. The path length is None for a robot with two or more coordinates.
    """

    _parts = (Grid, SizeEstimate)

    robot: str
    grid: Grid
    hits: NDArray[np.uint32]
    manipulability: NDArray[np.float32] | None
    limit_margin: NDArray[np.float32] | None
    directions: NDArray[np.uint8] | None
    bounds: FloatArray
    samples: int
    n_open: int
    sampling: Sampling
    rng: int
    path_length: SizeEstimate | None = None

    def __repr__(self) -> str:
        """Short summary with the main values."""
        shape = " x ".join(map(str, self.grid.shape))
        qualities = [name for name in get_args(Quality) if getattr(self, name) is not None]
        return summary_repr(
            self,
            self.robot,
            f"{self.samples:,} configurations by {self.sampling}",
            f"loops open at {self.n_open:,}" if self.n_open else "",
            ranges(self.bounds),
            str(self.size),
            f"{shape} cells of {self.grid.side:.4g} m",
            f"with {', '.join(qualities)}" if qualities else "",
            methods="section(axis, at), projection(axis), plot(), save(path)",
        )

    @property
    def size(self) -> SizeEstimate:
        """Volume [m^3], area [m^2] of a planar workspace, or length [m] of a curve."""
        return self.path_length or size_of(self.grid, self.hits)

    def section(self, axis: Literal["x", "y", "z"], at: float) -> NDArray[np.uint32]:
        """Return the number of configurations in each cell of a layer normal to an axis.

        Args:
            axis: The axis normal to the layer of cells.
            at: Coordinate of the layer along the axis [m].

        Returns:
            (n, m) number of configurations with the tool origin in each cell. Rows and columns are
            the two axes other than `axis`, in the order x, y, z.

        Raises:
            InputValueError: `axis` is unknown, or `at` is outside the grid.
        """
        k = _axis("section", axis)
        layer = int(np.floor((finite("section: at", at) - self.grid.lower[k]) / self.grid.side))
        if not 0 <= layer < self.grid.shape[k]:
            raise InputValueError(
                f"{axis} = {at:g} m: the layer is outside the workspace; expected "
                f"{self.grid.lower[k]:.4g} to {self.grid.upper[k]:.4g} m"
            )
        return np.asarray(np.take(self.hits, layer, axis=k))

    def projection(self, axis: Literal["x", "y", "z"]) -> NDArray[np.uint64]:
        """Return the numbers of configurations (n, m), summed along the axis "x", "y" or "z".

        The rows and columns of the result are the two other axes, in the order x, y, z.

        Raises:
            InputValueError: `axis` is unknown.
        """
        return np.asarray(self.hits.sum(_axis("projection", axis), dtype=np.uint64))

    def plot(self, ax: Any = None) -> Any:
        """Plot the workspace from above and from the side, or a planar workspace in its plane.

        Args:
            ax: matplotlib axes for a single view, or None for a new figure with two views. A single
                view looks along the direction in which the workspace is thinnest.

        Returns:
            The matplotlib axes of a single view, or an array of axes for two views.
        """
        from .pictures import plot_workspace  # noqa: PLC0415

        return plot_workspace(self, ax)


def workspace(
    robot: Robot,
    samples: int = 10_000_000,
    *,
    sampling: Sampling = "sobol",
    resolution: int = 100,
    quality: Collection[Quality] = (),
    rng: Rng = 0,
    threads: Threads = "all",
    client: Any = None,
    progress: bool | None = None,
) -> Workspace:
    """Sample the tool positions that a robot reaches within its limits.

    Args:
        robot: A robot. A revolute coordinate without limits is sampled over one turn.
        samples: Number of sampled configurations, an int or a float such as 1e7. Sampling "grid"
            rounds the number down to k^n with an integer k, for n coordinates.
        sampling: "sobol" for low-discrepancy points, "uniform" for independent random points, or
            "grid" for the nodes of a grid that includes the limits.
        resolution: Number of grid cells along the longest side of the workspace, at least 2.
        quality: Measures to compute for each cell: any of "manipulability", "limit_margin" (the
            distance from limits) and "directions" (of the tool's z axis). The attributes of
            `Workspace` with these names contain the results.
        rng: A seed (an int of at least 0), a `numpy.random.Generator`, or None for fresh random
            numbers. The same seed gives identical results for any number of threads and workers.
        threads: Number of threads in this process or in each worker, or "all" for one thread per
            core.
        client: A `dask.distributed.Client` that distributes the configurations to its workers, or
            None to compute in this process.
        progress: Whether to show a progress bar, which needs the package rich. None shows the bar
            only if standard error is a terminal.

    Returns:
        A `Workspace`. `hits` (nx, ny, nz) is the number of configurations with the tool origin in
        each cell. `grid` describes the cells in the base frame [m]. `bounds` (2, 3) contains the
        smallest and largest x, y and z of the tool origin [m]. `size` is the volume [m^3], area
        [m^2] or length [m] of the workspace, with an error estimate. `n_open` is the number of
        configurations whose loops do not close, which `hits` does not count.

    Raises:
        InputTypeError: `robot` is not a `Robot`, `samples` or `resolution` is not a real number, or
            `rng` has an unsupported type.
        ShapeError: `samples` or `resolution` is an array with one or more dimensions.
        InputValueError: A prismatic coordinate of the robot has no limits, or the loops close at
            none of the first 2^16 sampled configurations. The tool origin does not move.
            `sampling`, `quality` or `threads` has an unsupported value. `samples`, `resolution` or
            `rng` is too small or has a fractional part. A grid with this `resolution` would have
            more than 1e9 cells.
        NotInstalledError: SciPy is not installed. `pip install 'chasles[study]'` installs SciPy.
    """
    check_type("workspace: robot", robot, Robot)
    unknown = set(quality) - set(get_args(Quality))
    if unknown or integer_at_least("workspace: resolution", resolution, 1) < 2:  # noqa: PLR2004 - a side has two ends
        raise InputValueError(
            f"workspace: expected resolution >= 2 and quality from {', '.join(get_args(Quality))}, "
            f"got {resolution} and {', '.join(map(str, quality)) or 'no quality'}"
        )
    points = samples_of(robot, samples, sampling, key_of("workspace", rng))
    bounds = bounds_of(robot, points)
    work = _Visits(
        robot, points, Grid.from_bounds(bounds[0], bounds[1], resolution), frozenset(quality)
    )
    tally = tallied(
        work, points.pieces, threads=threads, client=client, progress=progress, name=robot.name
    )
    return _workspace(work, tally, bounds)


class _Counts:
    """Counts of configurations, best quality values and reached direction sectors per grid cell.

    The last entry of each array belongs to the configurations with open loops.
    """

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
    grid: Grid
    quality: frozenset[Quality]

    def empty(self) -> _Counts:
        return _Counts(self.grid.count, self.quality)

    def add(self, tally: _Counts, piece: int) -> None:
        for q in self.points.blocks(piece):
            T = self.robot.fk(q)
            cell = indices(self.grid, T[:, :3, 3])
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
    """Return the sector index of each direction, among 8 latitude zones of 8 sectors each.

    Args:
        z: (m, 3) unit vectors of the tool's z axis.
    """
    belt = np.clip(np.nan_to_num((z[:, 2] + 1) * (_SIDE / 2)), 0, _SIDE - 1).astype(np.uint64)
    turn = np.arctan2(z[:, 1], z[:, 0]) * (_SIDE / (2 * np.pi)) + _SIDE / 2
    meridian = np.clip(np.nan_to_num(turn), 0, _SIDE - 1).astype(np.uint64)
    return belt * np.uint64(_SIDE) + meridian


def _workspace(work: _Visits, tally: _Counts, bounds: FloatArray) -> Workspace:
    shape, points = work.grid.shape, work.points
    best = {name: tally.best[name][:-1].reshape(shape) for name in tally.best}
    sectors = tally.sectors
    directions = None if sectors is None else np.bitwise_count(sectors[:-1]).reshape(shape)
    return Workspace(
        robot=work.robot.name,
        grid=work.grid,
        hits=tally.hits[:-1].reshape(shape),
        manipulability=best.get("manipulability"),
        limit_margin=best.get("limit_margin"),
        directions=directions,
        bounds=bounds,
        samples=points.count,
        n_open=int(tally.hits[-1]),
        sampling=points.sampling,
        rng=points.key,
        path_length=_path_length(work.robot, points) if work.robot.n == 1 else None,
    )


def _path_length(robot: Robot, points: Samples) -> SizeEstimate:
    """Return the length of the tool path of a robot with one coordinate.

    The length omits the parts of the path where a loop does not close.
    """
    q = np.linspace(points.lower, points.upper, _PATH_POINTS)
    p = robot.fk(q)[:, :3, 3]
    fine, coarse = (
        float(np.nansum(np.linalg.norm(np.diff(p[::k], axis=0), axis=-1))) for k in (1, 2)
    )
    return SizeEstimate(fine, abs(fine - coarse), "m")


def _axis(method: str, name: str) -> int:
    if name not in ("x", "y", "z"):
        raise InputValueError(f"{method}: expected axis x, y or z, got {name!r}")
    return "xyz".index(name)


def bounds_of(robot: Robot, points: Samples) -> FloatArray:
    """Return the smallest and largest coordinates of the tool origin.

    Each bound is a local optimum. The optimization uses the exact Jacobian, and starts from the
    eight best of the first 2^16 samples.

    Args:
        robot: The robot.
        points: Sampled configurations of the robot.

    Returns:
        (2, 3) smallest and largest x, y and z of the tool origin [m].

    Raises:
        InputValueError: The loops of the robot do not close at any of the first 2^16 samples.
    """
    q = np.concatenate([block.copy() for block in points.blocks(0)])
    p = robot.fk(q)[:, :3, 3]
    closed = np.isfinite(p).all(-1)
    if not closed.any():
        raise InputValueError(
            f"{robot.name}: the loops do not close at any sample; check the limits (samples: "
            f"{len(q)})"
        )
    q, p = q[closed], p[closed]
    ends = np.empty((2, 3))
    for axis in range(3):
        for k, sign in enumerate((1, -1)):
            starts = q[np.argsort(sign * p[:, axis])[:_STARTS]]
            sampled = sign * p[:, axis].min() if sign > 0 else -p[:, axis].max()
            found = min(_least(robot, start, points, axis, sign) for start in starts)
            ends[k, axis] = sign * min(found, sampled)
    return ends


def _least(robot: Robot, start: FloatArray, points: Samples, axis: int, sign: int) -> float:
    """Minimize a coordinate of the tool origin, starting from a given configuration.

    If `sign` is -1, the function maximizes the coordinate and returns the negative maximum.
    """
    with requires("chasles[study]"):
        from scipy.optimize import minimize  # noqa: PLC0415

    def value(q: FloatArray) -> tuple[float, FloatArray]:
        T, J = robot.fk_jacobian_mixed(q[None])
        p, gradient = T[0, axis, 3], J[0, axis]
        # Configurations with open loops get a large finite objective value, because the line search
        # interpolates between objective values and cannot use inf.
        return (sign * p, sign * gradient) if np.isfinite(p) else (wall, np.zeros_like(q))

    T = robot.fk(start[None])
    wall = sign * float(T[0, axis, 3]) + float(np.abs(T[0, :3, 3]).max())
    bounds = list(zip(points.lower, points.upper, strict=True))
    options = {"maxfun": _CALLS, "ftol": 0.0, "xtol": _STEP, "gtol": _SLOPE}
    # The optimization method TNC needs no BLAS. BLAS calls on tiny matrices are slow, because the
    # BLAS threads must synchronize.
    with np.errstate(invalid="ignore"):
        found = minimize(value, start, jac=True, method="TNC", bounds=bounds, options=options)
    return float(found.fun)
