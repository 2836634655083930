"""The plane region that a serial robot's tool reaches, as an outline of few corners."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...chain.body_shapes import Skeleton
from ...chain.rigid_bodies import Array, TreeBody, skew
from ...model.tolerances import SAME_POINT, SAME_VIEW
from .contours import Loop, area, contours, simplified

_CELLS = 90
"""Cells along the longer side of the region."""
_MARGIN = 6
"""Free cells around the first samples."""
_FIRST = 30_000
"""Postures in the whole box of the coordinates."""
_MORE = 12_000
"""Postures near those at the boundary, in each round."""
_NEAR = (0.2, 0.2, 0.1, 0.1, 0.05, 0.05, 0.02, 0.02)
"""How near, in parts of the coordinates' ranges, in each round."""
_LEVEL = 5.9
"""The outline passes where so many of the nine cells around a point are reached: through the middle
of the last cells, of which the region covers a half on average."""
_LEAST = 12.0
"""Area of the smallest loop that is kept (cells)."""
_SLACK, _SLACKER = 0.2, 1.15
"""How far the outline may be off when corners are left out (cells), and the growth until few are
left."""
_CORNERS = 76
"""Most corners of all loops together."""
_PRIMES = (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37)


@dataclass(frozen=True)
class ToolRegion:
    """A region in a plane.

    Attributes:
        axes: Names of the coordinates to the right and up; r is the distance from the first axis.
        loops: Its boundary; a loop inside another one bounds a hole.
        moving: Indices of the coordinates that shape it, in q.
    """

    axes: tuple[str, str]
    loops: tuple[Loop, ...]
    moving: tuple[int, ...]


def reached(skeleton: Skeleton) -> ToolRegion | None:
    """The region that the tool's origin reaches within the limits; angles without limits turn once.

    If the first joint turns about a vertical axis, the region is the half section through that
    axis. If the tool stays in a coordinate plane, it is the region in this plane. Multiples of
    roots of primes fill the box of the coordinates; postures near those at the boundary find the
    rest. Points count by cells, whose size is no simple fraction of any length, so that the last
    digits of a machine do not matter.

    Args:
        skeleton: The bodies of a serial robot.

    Returns:
        The region; None where it is neither of both, has no area, a slide has no limits, or more
        than twelve coordinates move the tool.
    """
    box = _box(skeleton)
    if box is None:
        return None
    arm = _Arm(skeleton, *box)
    return (arm.section() if arm.is_upright else None) or arm.plane()


def _box(skeleton: Skeleton) -> tuple[Array, Array] | None:
    """Lowest and highest value of each coordinate (n,); None where `reached` has no region."""
    joints = [body.joint for body in skeleton.bodies if body.joint and body.joint.coordinate >= 0]
    own: dict[int, tuple[float, float]] = {}
    for joint in joints:
        low, high = joint.limits
        if joint.kind == "prismatic" and (low is None or high is None):
            return None
        if low is None and high is None:
            low, high = -math.pi, math.pi
        low = high - math.tau if low is None and high is not None else low
        high = low + math.tau if high is None and low is not None else high
        assert low is not None
        assert high is not None
        # A whole turn is enough, and more would leave fewer postures for each part of it.
        turns = joint.kind == "revolute" and high - low > math.tau
        own[joint.coordinate] = (-math.pi, math.pi) if turns else (low, high)
    box = np.array([own[k] for k in sorted(own)])
    return (box[:, 0], box[:, 1]) if len(box) <= len(_PRIMES) else None


class _Arm:
    """The tool's origin as a function of the coordinates."""

    def __init__(self, skeleton: Skeleton, lower: Array, upper: Array) -> None:
        self.skeleton, self.lower, self.upper = skeleton, lower, upper
        self.chain = _way(skeleton)
        first = next(k for k, body in enumerate(self.chain) if _moves(body))
        self.first = self.chain[first]
        joint = self.first.joint
        assert joint is not None
        T = np.eye(4)
        for body in self.chain[: first + 1]:
            T = T @ body.placement
        axis = T[:3, :3] @ joint.axis
        self.foot = T[:3, :3] @ joint.at + T[:3, 3]
        alone = sum(_coordinate(body) == joint.coordinate for body in self.chain) == 1
        self.is_upright = joint.kind == "revolute" and alone and abs(abs(axis[2]) - 1) < SAME_VIEW
        self.size = skeleton.size

    def at(self, q: Array) -> Array:
        """Positions of the tool's origin (m, 3) at postures (m, n)."""
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
                    p = p + turned + joint.advance * value * joint.axis
            p = p @ body.placement[:3, :3].T + body.placement[:3, 3]
        return p

    def section(self) -> ToolRegion | None:
        """The half section through the upright first axis; else None."""
        joint = self.first.joint
        assert joint is not None

        def seen(q: Array) -> Array:
            p = self.at(q) - self.foot * (1, 1, 0)
            return np.column_stack([np.sqrt(p[:, 0] ** 2 + p[:, 1] ** 2), p[:, 2]])

        return self._region(("r", "z"), seen, leaves_out=joint.coordinate)

    def plane(self) -> ToolRegion | None:
        """The region in the coordinate plane in which the tool stays; None where it leaves it."""
        p = self.at(_filling(self.lower, self.upper, len(_PRIMES)))
        thin = np.ptp(p, axis=0) < SAME_POINT * self.size
        if thin.sum() != 1:
            return None
        i, j = np.flatnonzero(~thin)
        return self._region(("xyz"[i], "xyz"[j]), lambda q: self.at(q)[:, [i, j]], leaves_out=-1)

    def _region(
        self, axes: tuple[str, str], seen: Callable[[Array], Array], leaves_out: int
    ) -> ToolRegion | None:
        moving = self._moving(seen, leaves_out)
        if len(moving) < 2:  # noqa: PLR2004 - a region of a plane
            return None
        lower, upper = self.lower[moving], self.upper[moving]

        def placed(some: Array) -> Array:
            q = np.tile((self.lower + self.upper) / 2, (len(some), 1))
            q[:, moving] = some
            return seen(q)

        loops = _outline(placed, lower, upper, starts_at_zero=axes[0] == "r")
        return ToolRegion(axes, loops, tuple(moving)) if loops else None

    def _moving(self, seen: Callable[[Array], Array], leaves_out: int) -> list[int]:
        """The coordinates that move the point."""
        q = _filling(self.lower, self.upper, len(_PRIMES))
        before = seen(q)
        found = []
        for k in range(len(self.lower)):
            other = q.copy()
            other[:, k] = np.roll(q[:, k], 1)
            if k != leaves_out and np.abs(seen(other) - before).max() > SAME_POINT * self.size:
                found.append(k)
        return found


def _way(skeleton: Skeleton) -> list[TreeBody]:
    """The bodies from the base to the tip."""
    found, k = [], skeleton.tip
    while k > 0:
        found.append(skeleton.bodies[k])
        k = skeleton.bodies[k].parent
    return found[::-1]


def _coordinate(body: TreeBody) -> int:
    return body.joint.coordinate if body.joint else -1


def _moves(body: TreeBody) -> bool:
    return _coordinate(body) >= 0


def _filling(lower: Array, upper: Array, count: int, begin: int = 0) -> Array:
    """Points (count, n) that fill a box evenly, from a given one on."""
    steps = np.array([math.sqrt(prime) % 1 for prime in _PRIMES[: len(lower)]])
    k = np.arange(begin + 1, begin + count + 1)[:, None]
    points: Array = lower + (upper - lower) * (k * steps % 1)
    return points


def _outline(
    seen: Callable[[Array], Array], lower: Array, upper: Array, *, starts_at_zero: bool
) -> tuple[Loop, ...]:
    """The boundary of the points of a plane that a box is mapped to."""
    q = _filling(lower, upper, _FIRST)
    points = seen(q)
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
        q = np.clip(own + away, lower, upper)
        cells.add(q, seen(q))
    return cells.loops(at_zero=starts_at_zero and corner[0] == 0)


class _Cells:
    """Cells of a plane, which of them are reached, and a posture for each."""

    def __init__(self, corner: Array, side: float, shape: tuple[int, int], n: int) -> None:
        self.corner, self.side, self.shape = corner, side, shape
        self.known = np.zeros(shape, dtype=bool)
        self.postures = np.zeros((*shape, n))

    def add(self, q: Array, points: Array) -> None:
        """Counts postures (m, n) with their points (m, 2); those outside are left out."""
        cell = np.floor((points - self.corner) / self.side).astype(int)
        inside = ((cell >= 0) & (cell < self.shape)).all(1)
        flat, first = np.unique(
            np.ravel_multi_index(tuple(cell[inside].T), self.shape), return_index=True
        )
        new = ~self.known.ravel()[flat]
        self.known.ravel()[flat] = True
        self.postures.reshape(-1, q.shape[1])[flat[new]] = q[inside][first[new]]

    def edge(self) -> Array:
        """A posture for each reached cell beside one that is not reached."""
        padded = np.pad(self.known, 1)
        around = padded[:-2, 1:-1] & padded[2:, 1:-1] & padded[1:-1, :-2] & padded[1:-1, 2:]
        return np.asarray(self.postures[self.known & ~around])

    def loops(self, *, at_zero: bool) -> tuple[Loop, ...]:
        """The boundary, smoothed over neighbouring cells, of at most `_CORNERS` corners."""
        wide = np.pad(self.known, 2).astype(int)
        if at_zero:
            wide[:2] = wide[2]
        levels = sum(np.roll(wide, (i, j), (0, 1)) for i in (-1, 0, 1) for j in (-1, 0, 1))
        assert isinstance(levels, np.ndarray)
        levels[[0, -1]] = levels[:, [0, -1]] = 0
        loops = [loop for loop in contours(levels, _LEVEL) if abs(area(loop)) > _LEAST]
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
