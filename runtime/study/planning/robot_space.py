"""The coordinates of a robot among obstacles: capsules around its links against shapes.

A way between two postures is free for certain, not at samples: where the clearance of a posture is
larger than any point of the robot can move on the way to the next one, nothing in between touches.
Where it is not, the way is halved, down to a resolution at which it counts as blocked. Points of a
serial robot move no further than their lever arms let them; how far loops move them is bounded for
each way by `loop_bounds.py`, and a way too close to a dead point counts as blocked.

Source:
    T. Duff and others, Building an orthonormal basis, revisited, 2017, for frames along links;
    F. Schwarzer, M. Saha, J.-C. Latombe, Adaptive dynamic collision checking for single and
    multiple articulated robots in complex environments, 2005.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...errors import InputValueError, ShapeError
from ..samples import box_of
from .loop_bounds import LoopBounds, loop_bounds

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_RESOLUTION = 1e-3
"""Part of the box of the coordinates below which a way is not halved further."""
_STEP = 1e-5
"""Step that shows which frames a joint moves [rad or m]."""
_POINT = 1e-9
"""Length [m] below which a capsule is a ball."""


@dataclass(frozen=True, eq=False)
class Obstacle:
    """A shape at a place.

    Attributes:
        shape: The shape of the library coal.
        T_0_shape: (4, 4) its pose in the base frame.
        name: Its name.
    """

    shape: Any
    T_0_shape: FloatArray
    name: str


def ball(centre: ArrayLike, radius: float, name: str = "ball") -> Obstacle:
    """A ball: centre (3,) and radius [m] in the base frame."""
    import coal  # noqa: PLC0415

    T = np.eye(4)
    T[:3, 3] = _read("ball: centre", centre, (3,))
    return Obstacle(coal.Sphere(_above_0("ball: radius", radius)), T, name)


def block(T_0_block: ArrayLike, sides: ArrayLike, name: str = "block") -> Obstacle:
    """A box: pose (4, 4) of its middle in the base frame, and sides (3,) [m]."""
    import coal  # noqa: PLC0415

    lengths = [_above_0("block: sides", side) for side in _read("block: sides", sides, (3,))]
    return Obstacle(coal.Box(*lengths), _read("block: T_0_block", T_0_block, (4, 4)), name)


def capsule(start: ArrayLike, end: ArrayLike, radius: float, name: str = "capsule") -> Obstacle:
    """All points within a radius [m] of the line between two points (3,) in the base frame."""
    import coal  # noqa: PLC0415

    a, b = _read("capsule: start", start, (3,)), _read("capsule: end", end, (3,))
    length, T = _along(a[None], b[None])
    shape = coal.Capsule(_above_0("capsule: radius", radius), float(length[0]))
    return Obstacle(shape, T[0], name)


def mesh(
    path: str | os.PathLike[str], T_0_mesh: ArrayLike | None = None, name: str = ""
) -> Obstacle:
    """The surface of a file (.stl, .obj, .dae), in metres: pose (4, 4) in the base frame."""
    import coal  # noqa: PLC0415

    if not Path(path).is_file():
        raise InputValueError(f"mesh: there is no file {os.fspath(path)}")
    shape = coal.MeshLoader().load(os.fspath(path), np.ones(3))
    T = _read("mesh: T_0_mesh", np.eye(4) if T_0_mesh is None else T_0_mesh, (4, 4))
    return Obstacle(shape, T, name or Path(path).name)


@dataclass(frozen=True, eq=False)
class RobotSpace:
    """A robot's coordinates within limits, free where no link touches an obstacle or another link.

    Link k is a capsule between the origins of frames k and k + 1 of `link_poses`, the last
    between the last frame and the tool. Links may touch where the arm between them is shorter than
    their radii together, since they touch in every posture then.

    Attributes:
        robot: The robot.
        obstacles: Shapes at rest.
        radii: (links,) radii of the capsules [m].
        lower: (n,) least coordinates [rad or m].
        upper: (n,) largest coordinates [rad or m].
        checks: What is kept apart: an index into links, and one into obstacles or, counted from
            their number on, into links.
        travel: (checks, n) how far the two may approach each other at most, for a unit of each
            coordinate [m]; None for a robot with loops.
        bounds: Bounds of the motion of a robot with loops; None for a serial one.
    """

    robot: Any
    obstacles: tuple[Obstacle, ...]
    radii: FloatArray
    lower: FloatArray
    upper: FloatArray
    checks: tuple[tuple[int, int], ...]
    travel: FloatArray | None
    bounds: LoopBounds | None

    def free(self, points: FloatArray) -> BoolArray:
        """Whether nothing touches at postures (m, n)."""
        return np.array([self.clearance(q)[0] > 0 for q in points], dtype=bool)

    def free_way(self, a: FloatArray, b: FloatArray) -> bool:
        """Whether nothing touches on the straight way between two postures (n,), for certain."""
        least = _RESOLUTION * float(np.max(self.upper - self.lower))
        ways = [(a, b)]
        while ways:
            start, end = ways.pop()
            middle, half = (start + end) / 2, np.abs(end - start) / 2
            distances = self.distances(middle)
            if distances.min() <= 0:
                return False
            if (distances > self.approach(start, end)).all():
                continue
            if half.max() < least:
                return False
            ways += [(start, middle), (middle, end)]
        return True

    def approach(self, a: FloatArray, b: FloatArray) -> FloatArray:
        """How far the two of each check approach each other at most, from the middle of a way.

        Args:
            a: (n,) start of the straight way [rad or m].
            b: (n,) its end.

        Returns:
            (checks,) distances [m]; inf where loops are open on the way or too near a dead point.
        """
        if self.travel is not None:
            return np.asarray(self.travel @ (np.abs(b - a) / 2))
        assert self.bounds is not None
        points = _frames(self.robot, ((a + b) / 2)[None])[0]
        ends = self.bounds.frames(a, b, points)
        moves = np.maximum(ends[:-1], ends[1:])
        first = len(self.obstacles)
        return np.array(
            [moves[i] + (moves[j - first] if j >= first else 0.0) for i, j in self.checks]
        )

    def clearance(self, q: FloatArray) -> tuple[float, str]:
        """The least distance at a posture.

        Args:
            q: (n,) coordinates [rad or m].

        Returns:
            The distance [m], not positive where something touches or a loop is open, and what is
            nearest, in words.
        """
        distances = self.distances(q)
        k = int(np.argmin(distances))
        if np.isneginf(distances[k]):
            return -np.inf, "the loops do not close"
        link, other = self.checks[k]
        beyond = other - len(self.obstacles)
        name = self.obstacles[other].name if beyond < 0 else f"link {beyond}"
        return float(distances[k]), f"link {link} and {name}"

    def distances(self, q: FloatArray) -> FloatArray:
        """(checks,) distances at a posture (n,) [m]; -inf where loops are open."""
        import coal  # noqa: PLC0415

        points = _frames(self.robot, q[None])[0]
        if not np.isfinite(points).all():
            return np.full(len(self.checks), -np.inf)
        lengths, T = _along(points[:-1], points[1:])
        shapes = [obstacle.shape for obstacle in self.obstacles]
        shapes += [coal.Capsule(r, x) for r, x in zip(self.radii, lengths, strict=True)]
        poses = [*(obstacle.T_0_shape for obstacle in self.obstacles), *T]
        places = [coal.Transform3s(pose[:3, :3], pose[:3, 3]) for pose in poses]
        request, result, first = coal.DistanceRequest(), coal.DistanceResult(), len(self.obstacles)
        found = np.empty(len(self.checks))
        for k, (link, other) in enumerate(self.checks):
            result.clear()
            own = first + link
            found[k] = coal.distance(
                shapes[own], places[own], shapes[other], places[other], request, result
            )
        return found

    def why(self, q: FloatArray) -> str:
        """What touches at a posture (n,), in words."""
        beyond = np.flatnonzero(~((q >= self.lower) & (q <= self.upper)))
        if len(beyond):
            return f"{self.robot.coordinates[beyond[0]].name} is beyond its limits"
        distance, nearest = self.clearance(q)
        return nearest if np.isneginf(distance) else f"{nearest} touch"


def robot_space(
    robot: Any, obstacles: Sequence[Obstacle] = (), *, radius: float | Sequence[float]
) -> RobotSpace:
    """The coordinates of a robot among obstacles.

    Args:
        robot: A robot with `link_poses`.
        obstacles: Shapes in the base frame, from `ball`, `block`, `capsule` or `mesh`.
        radius: Radius of the capsules around its links [m], or one a link.

    Raises:
        InputValueError: A slider has no limits, or the radii are not positive.
        ShapeError: There are not as many radii as links.
    """
    lower, upper = box_of(robot)
    lengths = _longest(robot, lower, upper)
    radii = np.asarray(radius, dtype=np.float64)
    if radii.shape not in ((), lengths.shape):
        raise ShapeError(f"radius: expected a number or {len(lengths)}, got shape {radii.shape}")
    radii = np.broadcast_to(radii, lengths.shape)
    if not (radii > 0).all():
        raise InputValueError(f"radius: expected values above 0, got {radius}")
    first = len(obstacles)
    near = [(k, i) for k in range(len(lengths)) for i in range(first)]
    own = [(j, first + i) for i, j in _pairs(lengths, radii)]
    if not near + own:
        raise InputValueError(f"{robot.name}: there is nothing that its links could touch")
    travel = None
    if not robot.loops:
        moves = _travel(robot, lengths, radii)
        apart = [_between(robot, moves, i - first, j) for j, i in own]
        travel = np.array([moves[k] for k, _ in near] + apart)
    bounds = loop_bounds(robot, lower, upper) if robot.loops else None
    return RobotSpace(
        robot, tuple(obstacles), radii, lower, upper, tuple(near + own), travel, bounds
    )


def _pairs(lengths: FloatArray, radii: FloatArray) -> list[tuple[int, int]]:
    """Pairs of links with enough of the arm between them that they need not touch."""
    links = range(len(lengths))
    return [
        (i, j)
        for i in links
        for j in links[i + 2 :]
        if lengths[i + 1 : j].sum() > radii[i] + radii[j]
    ]


def _between(robot: Any, travel: FloatArray, i: int, j: int) -> FloatArray:
    """How far link j approaches link i, which is nearer to the base, for a unit of each joint."""
    return np.where(_axes(robot)[0] <= i, 0, travel[i] + travel[j])


def _frames(robot: Any, q: FloatArray) -> FloatArray:
    """(m, links + 1, 3) origins of the links' frames and of the tool."""
    links, tool = robot.link_poses(q)[..., :3, 3], robot.fk(q)[:, None, :3, 3]
    return np.concatenate([links, tool], axis=1)


def _longest(robot: Any, lower: FloatArray, upper: FloatArray) -> FloatArray:
    """(links,) the largest distance between successive frames: convex in a slide, so at an end."""
    points = _frames(robot, np.array([lower, upper, (lower + upper) / 2]))
    return np.asarray(np.nanmax(np.linalg.norm(np.diff(points, axis=1), axis=-1), axis=0))


def _travel(robot: Any, lengths: FloatArray, radii: FloatArray) -> FloatArray:
    """(links, n) how far a point of each link moves at most, for a unit of each coordinate [m]."""
    first, offset = _axes(robot)
    turns = np.array([coordinate.unit == "rad" for coordinate in robot.coordinates])
    travel = np.zeros((len(lengths), robot.n))
    for k, j in np.ndindex(travel.shape):
        # The far end of link k belongs to frame k + 1.
        if first[j] <= k + 1:
            beyond = offset[j] + lengths[first[j] : k + 1].sum() + radii[k]
            travel[k, j] = beyond if turns[j] else 1.0
    return travel


@lru_cache
def _axes(robot: Any) -> tuple[NDArray[np.intp], FloatArray]:
    """The first frame that each joint of a serial robot moves, and its distance from the axis."""
    lower, upper = box_of(robot)
    q = lower + (upper - lower) * np.random.default_rng(0).random(robot.n)
    poses = np.concatenate([robot.link_poses(q), robot.fk(q)[None]])
    twists = robot.jacobian_space(q).T
    first, offset = np.empty(robot.n, dtype=np.intp), np.empty(robot.n)
    for j, step in enumerate(_STEP * np.eye(robot.n)):
        moved = np.concatenate([robot.link_poses(q + step), robot.fk(q + step)[None]])
        first[j] = np.argmax(np.abs(moved - poses).max((1, 2)) > _STEP / 2)
        v, omega = twists[j, :3], twists[j, 3:]
        offset[j] = np.linalg.norm(v + np.cross(omega, poses[first[j], :3, 3]))
    return first, offset


def _along(a: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(m,) distances, and (m, 4, 4) poses in the middle between points (m, 3) with z along them."""
    step = b - a
    length = np.linalg.norm(step, axis=-1)
    z = np.where(length[:, None] > _POINT, step / np.maximum(length, _POINT)[:, None], [0, 0, 1])
    # The frame of Frisvad and Duff: x and y from z without a cross product.
    sign = np.where(z[:, 2] >= 0, 1.0, -1.0)
    u = -1 / (sign + z[:, 2])
    v = z[:, 0] * z[:, 1] * u
    x = np.stack([1 + sign * z[:, 0] ** 2 * u, sign * v, -sign * z[:, 0]], axis=-1)
    y = np.stack([v, sign + z[:, 1] ** 2 * u, -z[:, 1]], axis=-1)
    T = np.tile(np.eye(4), (len(a), 1, 1))
    T[:, :3, :3] = np.stack([x, y, z], axis=-1)
    T[:, :3, 3] = (a + b) / 2
    return np.asarray(length), T


def _read(name: str, value: ArrayLike, shape: tuple[int, ...]) -> FloatArray:
    array = np.asarray(value, dtype=np.float64)
    if array.shape != shape:
        raise ShapeError(f"{name}: expected shape {shape}, got {array.shape}")
    if not np.isfinite(array).all():
        raise InputValueError(f"{name}: expected finite numbers")
    return array


def _above_0(name: str, value: float) -> float:
    if not value > 0:
        raise InputValueError(f"{name}: expected values above 0, got {value:g}")
    return float(value)
