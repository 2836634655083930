"""Computes the planar region that a tool can reach."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from chasles.contract import BodyJoint

from ...chain.body_shapes import Skeleton
from ...chain.rigid_bodies import Array, TreeBody, skew
from ...model.tolerances import SAME_POINT, SAME_VIEW
from .contours import Loop, area, contours, simplified

_CELLS = 90
"""Number of grid cells along the longer side of the region."""
_MARGIN = 6
"""Number of empty grid cells around the cells of the first samples."""
_FIRST = 30_000
"""Number of configurations that are sampled over the whole coordinate ranges."""
_MORE = 12_000
"""Number of configurations that are sampled near the boundary of the region in each round."""
_NEAR = (0.2, 0.2, 0.1, 0.1, 0.05, 0.05, 0.02, 0.02)
"""Maximum offset of a new sample from a known sample near the boundary in each round, as a fraction
of each coordinate range."""
_LEVEL = 5.9
"""Level of the contour line that is the outline of the region. The contoured value of a grid cell
is the number of reached cells among the cell and its eight neighbors. The outline passes through
the middle of the outermost cells."""
_MIN = 12.0
"""Minimum area of a boundary polygon, in cells."""
_SLACK, _SLACKER = 0.2, 1.15
"""Initial tolerance of the simplified outline (cells), and the factor that increases the tolerance
after each attempt."""
_CORNERS = 76
"""Maximum total number of corners of the polygons that bound a region."""
_TRIED = 60
"""Number of sampled configurations for finding the coordinates that move the tool."""
_PRIMES = (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37)


@dataclass(frozen=True)
class ToolRegion:
    """A planar region that the tool reaches.

    Attributes:
        axes: Names of the horizontal and the vertical axis of the figure, where r is the distance
            from the first joint axis.
        loops: The boundary polygons. An inner polygon bounds a hole.
        moving: Indices in q of the coordinates that determine the region.
        upright: Index of the coordinate that rotates the region about a vertical axis, or -1 for a
            planar arm.
    """

    axes: tuple[str, str]
    loops: tuple[Loop, ...]
    moving: tuple[int, ...]
    upright: int = -1


@dataclass(frozen=True)
class ToolPosition:
    """The position of the tool's origin as a function of the coordinates.

    Attributes:
        at: Function that returns tool positions (m, 3) for configurations (m, n), with NaN rows
            where a loop does not close.
        lower: Lowest value of each coordinate (n,).
        upper: Highest value of each coordinate (n,).
        size: The robot's size (meter).
        upright: Index of the coordinate that rotates the robot about a vertical axis, and a point
            on this axis. ``upright`` is None if no coordinate rotates the robot about a vertical
            axis.
    """

    at: Callable[[Array], Array]
    lower: Array
    upper: Array
    size: float
    upright: tuple[int, Array] | None

    def region(self) -> ToolRegion | None:
        """Return the region that the tool reaches in a vertical section or a coordinate plane."""
        return self._section() or self._plane()

    def _section(self) -> ToolRegion | None:
        if self.upright is None:
            return None
        index, foot = self.upright

        def seen(q: Array) -> Array:
            p = self.at(q) - foot * (1, 1, 0)
            return np.column_stack([np.sqrt(p[:, 0] ** 2 + p[:, 1] ** 2), p[:, 2]])

        return self._region(("r", "z"), seen, leaves_out=index)

    def _plane(self) -> ToolRegion | None:
        p = self.at(_filling(self.lower, self.upper, _TRIED))
        p = p[np.isfinite(p).all(1)]
        if len(p) == 0:
            return None
        thin = np.ptp(p, axis=0) < SAME_POINT * self.size
        if thin.sum() != 1:
            return None
        i, j = np.flatnonzero(~thin)
        return self._region(("xyz"[i], "xyz"[j]), lambda q: self.at(q)[:, [i, j]], leaves_out=-1)

    def _region(
        self, axes: tuple[str, str], seen: Callable[[Array], Array], leaves_out: int
    ) -> ToolRegion | None:
        moving = self._moving(seen)
        if leaves_out in moving or len(moving) < 2:  # noqa: PLR2004 - a plane has two axes
            return None
        lower, upper = self.lower[moving], self.upper[moving]

        def placed(some: Array) -> Array:
            q = np.tile((self.lower + self.upper) / 2, (len(some), 1))
            q[:, moving] = some
            return seen(q)

        loops = _outline(placed, lower, upper, starts_at_zero=axes[0] == "r")
        return ToolRegion(axes, loops, tuple(moving), leaves_out) if loops else None

    def _moving(self, seen: Callable[[Array], Array]) -> list[int]:
        q = _filling(self.lower, self.upper, _TRIED)
        before = seen(q)
        found = []
        for k in range(len(self.lower)):
            other = q.copy()
            other[:, k] = np.roll(q[:, k], 1)
            change = np.abs(seen(other) - before)
            if np.any(change[np.isfinite(change)] > SAME_POINT * self.size):
                found.append(k)
        return found


def reached(skeleton: Skeleton) -> ToolRegion | None:
    """Return the region that a serial robot's tool reaches within the joint limits.

    If the tool stays in a coordinate plane, the tool's region lies in this plane. Joint angles
    without limits cover one revolution. The sampled configurations fill the box of coordinate
    ranges evenly. In sample k, each coordinate is at the fraction ``k sqrt(p) mod 1`` of its range,
    with a different prime p for each coordinate. Further samples near the boundary of the region
    make its outline accurate. The size of the grid cells is not a simple fraction of robot lengths,
    so that machine-dependent rounding errors do not change the region.

    Args:
        skeleton: The bodies of a serial robot.

    Returns:
        The region, or None if the first axis is not vertical and the tool leaves every coordinate
        plane. The function also returns None for a region of zero area, a prismatic joint that
        lacks a limit, or more than twelve coordinates.
    """
    own: dict[int, tuple[bool, float | None, float | None]] = {}
    for body in skeleton.bodies:
        if body.joint and body.joint.coordinate >= 0:
            slides = body.joint.kind == "prismatic"
            own[body.joint.coordinate] = (slides, *body.limits)
    found = box([own[k] for k in sorted(own)])
    return _Arm(skeleton).position(*found).region() if found else None


def box(
    coordinates: Sequence[tuple[bool, float | None, float | None]],
) -> tuple[Array, Array] | None:
    """Return the lowest and the highest value of each coordinate (n,).

    Args:
        coordinates: Tuple (whether the coordinate is a length, lower limit, upper limit) for each
            coordinate, in radian or meter.

    Returns:
        The lowest and highest values, or None if a prismatic coordinate lacks a limit or there are
        more than twelve coordinates.
    """
    own = []
    for slides, low, high in coordinates:
        if slides and (low is None or high is None):
            return None
        own.append((low, high) if slides else _turn(low, high))
    ends = np.array(own, dtype=float)
    return (ends[:, 0], ends[:, 1]) if 0 < len(ends) <= len(_PRIMES) else None


def _turn(low: float | None, high: float | None) -> tuple[float, float]:
    if low is None and high is None:
        return -math.pi, math.pi
    if low is None:
        assert high is not None
        return high - math.tau, high
    if high is None:
        return low, low + math.tau
    return (-math.pi, math.pi) if high - low > math.tau else (low, high)


class _Arm:
    def __init__(self, skeleton: Skeleton) -> None:
        self.skeleton = skeleton
        self.chain = path(skeleton)

    def position(self, lower: Array, upper: Array) -> ToolPosition:
        first, axis, foot = first_axis(self.chain)
        alone = sum(_coordinate(body) == first.coordinate for body in self.chain) == 1
        is_upright = first.kind == "revolute" and alone and is_vertical(axis)
        upright = (first.coordinate, foot) if is_upright else None
        return ToolPosition(self.at, lower, upper, self.skeleton.size, upright)

    def at(self, q: Array) -> Array:
        p = np.tile(self.skeleton.tip_placement[:3, 3], (len(q), 1))
        for body in reversed(self.chain):
            joint = body.joint
            assert joint is not None
            if joint.coordinate >= 0:
                value = (joint.ratio * q[:, joint.coordinate] + joint.offset)[:, None]
                if joint.kind == "prismatic":
                    p = p + value * joint.axis
                else:
                    K, arm = skew(joint.axis), p - joint.at
                    turned = np.sin(value) * (arm @ K.T) + (1 - np.cos(value)) * (arm @ (K @ K).T)
                    p = p + turned + joint.advance * value * np.array(joint.axis)
            p = p @ body.placement[:3, :3].T + body.placement[:3, 3]
        return p


def first_axis(chain: Sequence[TreeBody]) -> tuple[BodyJoint, Array, Array]:
    """Return the first moving joint of a chain, its axis direction and a point on its axis."""
    T = np.eye(4)
    for body in chain:
        T = T @ body.placement
        if body.joint is not None and body.joint.coordinate >= 0:
            return body.joint, T[:3, :3] @ body.joint.axis, T[:3, :3] @ body.joint.at + T[:3, 3]
    raise ValueError("a chain without a moving joint")


def is_vertical(axis: Array) -> bool:
    """Whether a direction is parallel to the z axis of the base."""
    return bool(abs(abs(axis[2]) - 1) < SAME_VIEW)


def path(skeleton: Skeleton) -> list[TreeBody]:
    """Return the bodies from the base to the tip of the chain."""
    found, k = [], skeleton.tip
    while k > 0:
        found.append(skeleton.bodies[k])
        k = skeleton.bodies[k].parent
    return found[::-1]


def _coordinate(body: TreeBody) -> int:
    return body.joint.coordinate if body.joint else -1


def _filling(lower: Array, upper: Array, count: int, begin: int = 0) -> Array:
    steps = np.array([math.sqrt(prime) % 1 for prime in _PRIMES[: len(lower)]])
    k = np.arange(begin + 1, begin + count + 1)[:, None]
    points: Array = lower + (upper - lower) * (k * steps % 1)
    return points


def _outline(
    seen: Callable[[Array], Array], lower: Array, upper: Array, *, starts_at_zero: bool
) -> tuple[Loop, ...]:
    q, points = _closed(_filling(lower, upper, _FIRST), seen)
    if len(q) < 2:  # noqa: PLR2004 - a range needs two points
        return ()
    span = float(np.ptp(points, axis=0).max())
    if np.ptp(points, axis=0).min() < span / _CELLS:
        return ()
    side = float(f"{span / (_CELLS - 1 / math.sqrt(2)):.6g}")
    corner = points.min(0) - side * (_MARGIN + math.sqrt(3) / 4)
    if starts_at_zero:
        corner[0] = max(corner[0] // side, 0) * side
    corner = np.array([float(f"{value:.6g}") for value in corner])
    shape = np.ceil((points.max(0) - corner) / side).astype(int) + _MARGIN
    cells = _Cells(corner, side, (int(shape[0]), int(shape[1])), len(lower))
    cells.add(q, points)
    for k, near in enumerate(_NEAR):
        edge = cells.edge()
        own = np.resize(edge, (_MORE, len(lower)))
        away = _filling(near * (lower - upper), near * (upper - lower), _MORE, k * _MORE)
        cells.add(*_closed(np.clip(own + away, lower, upper), seen))
    return cells.loops(at_zero=starts_at_zero and corner[0] == 0)


def _closed(q: Array, seen: Callable[[Array], Array]) -> tuple[Array, Array]:
    points = seen(q)
    is_there = np.isfinite(points).all(1)
    return q[is_there], points[is_there]


class _Cells:
    """Grid cells of a plane.

    Each reached grid cell stores one configuration that moves the tool into the cell.
    """

    def __init__(self, corner: Array, side: float, shape: tuple[int, int], n: int) -> None:
        self.corner, self.side, self.shape = corner, side, shape
        self.known = np.zeros(shape, dtype=bool)
        self.configurations = np.zeros((*shape, n))

    def add(self, q: Array, points: Array) -> None:
        cell = np.floor((points - self.corner) / self.side).astype(int)
        inside = ((cell >= 0) & (cell < self.shape)).all(1)
        flat, first = np.unique(
            np.ravel_multi_index(tuple(cell[inside].T), self.shape), return_index=True
        )
        new = ~self.known.ravel()[flat]
        self.known.ravel()[flat] = True
        self.configurations.reshape(-1, q.shape[1])[flat[new]] = q[inside][first[new]]

    def edge(self) -> Array:
        padded = np.pad(self.known, 1)
        around = padded[:-2, 1:-1] & padded[2:, 1:-1] & padded[1:-1, :-2] & padded[1:-1, 2:]
        return np.asarray(self.configurations[self.known & ~around])

    def loops(self, *, at_zero: bool) -> tuple[Loop, ...]:
        wide = np.pad(self.known, 2).astype(int)
        if at_zero:
            wide[:2] = wide[2]
        levels = sum(np.roll(wide, (i, j), (0, 1)) for i in (-1, 0, 1) for j in (-1, 0, 1))
        assert isinstance(levels, np.ndarray)
        levels[[0, -1]] = levels[:, [0, -1]] = 0
        loops = [loop for loop in contours(levels, _LEVEL) if abs(area(loop)) > _MIN]
        slack, kept = _SLACK, loops
        while not kept or sum(map(len, kept)) > _CORNERS:
            kept = [simplified(loop, slack) for loop in loops]
            slack *= _SLACKER
            if not loops:
                return ()
        low = 0.0 if at_zero else -math.inf
        x, y = self.corner - 1.5 * self.side
        return tuple(
            [(max(x + a * self.side, low), y + b * self.side) for a, b in loop] for loop in kept
        )
