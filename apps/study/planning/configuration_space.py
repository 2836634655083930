"""Configuration space of a robot among obstacles.

Segments between configurations are checked continuously, not at samples. A segment is free of
contact if the clearance at its middle exceeds the largest displacement of any point of the robot
along the segment. A segment that is not proven free is halved, and each half is checked. A segment
whose half length is below the resolution counts as blocked if it is not proven free.
`loop_bounds.py` bounds the motion of the passive joints of loops. `hulls.py` bounds the body motion
caused by joints. A segment near a dead point or a parallel singularity counts as blocked, so no
free segment connects different assembly modes.

Source:
    F. Schwarzer, M. Saha, J.-C. Latombe, Adaptive dynamic collision checking for single and
    multiple articulated robots in complex environments, 2005.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chasles import InputValueError, Robot, ShapeError
from chasles.contract import check_type, requires
from chasles.summaries import summary_repr

from ..arguments import real
from ..samples import box_of
from .hulls import Hulls, hulls_of, joined
from .loop_bounds import LoopBounds, closed_configurations, loop_bounds
from .obstacles import Obstacle

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_RESOLUTION = 1e-3
"""Half length below which a segment is not halved further, relative to the largest coordinate
range."""


@dataclass(frozen=True, eq=False)
class ConfigurationSpace:
    """The configurations of a robot within limits, with collision tests.

    The shapes of links, rods and cylinders are the lines and plates of the robot's drawing,
    thickened by a radius. Contact between bodies that a joint connects is ignored. Contact between
    two bodies is also ignored if they touch in each of many random configurations.

    Attributes:
        robot: The robot.
        obstacles: The obstacles.
        hulls: The collision shapes of the robot.
        radii: (k,) radius by which the shapes of each of the k `bodies` are thickened [m].
        lower: (n,) smallest coordinates [rad or m].
        upper: (n,) largest coordinates [rad or m].
        checks: Pairs of indices for collision checks. The first index is the index of a collision
            shape in `hulls`. The second index is the index of an obstacle, or the number of
            obstacles plus the index of a collision shape.
        bounds: Bounds of the joint motion of a robot with loops, or None without loops.
    """

    robot: Robot
    obstacles: tuple[Obstacle, ...]
    hulls: Hulls
    radii: FloatArray
    lower: FloatArray
    upper: FloatArray
    checks: tuple[tuple[int, int], ...]
    bounds: LoopBounds | None

    def __repr__(self) -> str:
        """Short summary with the main values."""
        among = ", ".join(obstacle.name for obstacle in self.obstacles)
        return summary_repr(
            self,
            self.robot.name,
            f"among {among}" if among else "without obstacles",
            f"{len(self.bodies)} bodies, {len(self.checks)} distances between shapes",
            methods="bodies, is_free(q), clearance(q), is_free_segment(a, b)",
        )

    @property
    def bodies(self) -> tuple[str, ...]:
        """Names of the links, rods and cylinders that have a collision shape."""
        return self.hulls.parts

    def is_free(self, q: FloatArray) -> BoolArray:
        """Return a mask (m,) of configurations (m, n) without contact.

        Coordinate limits are ignored.
        """
        z = self.hulls.configuration(q)
        found: BoolArray = np.asarray(np.isfinite(z).all(-1))
        found[found] = [(apart > 0).all() for apart in self._distances_at(z[found])]
        return np.asarray(found)

    def is_free_segment(self, a: FloatArray, b: FloatArray) -> bool:
        """Return whether the segment from a (n,) to b (n,) is proven free of contact."""
        least = _RESOLUTION * float(np.max(self.upper - self.lower))
        segments = [(a, b)]
        while segments:
            start, end = segments.pop()
            middle, half = (start + end) / 2, np.abs(end - start) / 2
            distances = self.distances(middle)
            if distances.min() <= 0:
                return False
            if (distances > self._approach(start, end)).all():
                continue
            if half.max() < least:
                return False
            segments += [(start, middle), (middle, end)]
        return True

    def _approach(self, a: FloatArray, b: FloatArray) -> FloatArray:
        """Bound the decrease of each checked distance from the middle to any point of a segment.

        Args:
            a: (n,) start of the segment [rad or m].
            b: (n,) end of the segment [rad or m].

        Returns:
            (checks,) bounds [m], or inf for all checks if a loop is open or near a dead point
            somewhere on the segment.
        """
        z, w = (a + b) / 2, np.abs(b - a) / 2
        if self.bounds is not None:
            joints = self.bounds.joints(a, b)
            if joints is None:
                return np.full(len(self.checks), np.inf)
            z, w = self.hulls.configuration(z[None])[0], joints
        moves = self.hulls.moves(z, w)
        own, others, common = self._pairs
        others_move = np.where(others < 0, 0.0, moves[common, np.maximum(others, 0)])
        return np.asarray(moves[common, own] + others_move)

    def clearance(self, q: FloatArray) -> tuple[float, str]:
        """Return the smallest distance between two checked shapes at a configuration.

        Args:
            q: (n,) coordinates [rad or m].

        Returns:
            The distance [m] and the names of the nearest shapes. In a collision, the distance is at
            most 0. If the loops do not close, the distance is -inf.
        """
        distances = self.distances(q)
        k = int(np.argmin(distances))
        if np.isneginf(distances[k]):
            return -np.inf, "the loops do not close"
        own, other = self.checks[k]
        beyond = other - len(self.obstacles)
        name = self.obstacles[other].name if beyond < 0 else self._named(beyond)
        return float(distances[k]), f"{self._named(own)} and {name}"

    def distances(self, q: FloatArray) -> FloatArray:
        """Return the distance [m] of each pair in `checks` at q (n,), or -inf with open loops."""
        z = self.hulls.configuration(q[None])
        if not np.isfinite(z).all():
            return np.full(len(self.checks), -np.inf)
        return np.asarray(self._distances_at(z)[0])

    def _distances_at(self, z: FloatArray) -> FloatArray:
        """Return distances (m, checks) [m] for m vectors of joint values z (m, n_z)."""
        with requires("chasles[planning]"):
            import coal  # noqa: PLC0415

        radii, resting, first = self._radii, self.obstacles, len(self.obstacles)
        fixed = [coal.Transform3s(o.T_0_shape[:3, :3], o.T_0_shape[:3, 3]) for o in resting]
        request, result = coal.DistanceRequest(), coal.DistanceResult()
        found = np.empty((len(z), len(self.checks)))
        for row, T, lengths in zip(found, *self.hulls.poses(z), strict=True):
            shapes = [obstacle.shape for obstacle in resting]
            shapes += [
                coal.Capsule(radii[k], lengths[k]) if shape is None else shape
                for k, shape in enumerate(self._shapes)
            ]
            places = fixed + [coal.Transform3s(pose[:3, :3], pose[:3, 3]) for pose in T]
            for k, (own, other) in enumerate(self.checks):
                result.clear()
                pair = shapes[first + own], places[first + own], shapes[other], places[other]
                row[k] = coal.distance(*pair, request, result)
        return found

    def explain(self, q: FloatArray) -> str:
        """Return the reason why the configuration (n,) is in collision or outside the limits."""
        beyond = np.flatnonzero(~((q >= self.lower) & (q <= self.upper)))
        if len(beyond):
            return f"{self.robot.coordinates[beyond[0]].name} is beyond its limits"
        distance, nearest = self.clearance(q)
        return nearest if np.isneginf(distance) else f"{nearest} touch"

    def _named(self, k: int) -> str:
        hull = self.hulls.hulls[k]
        return hull.part if hull.bodies.any() else "the base"

    @cached_property
    def _radii(self) -> list[float]:
        by_part = dict(zip(self.bodies, self.radii.tolist(), strict=True))
        return [by_part[hull.part] for hull in self.hulls.hulls]

    @cached_property
    def _shapes(self) -> list[Any]:
        return self.hulls.shapes(np.array(self._radii))

    @cached_property
    def _pairs(self) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
        """Return (shape, second shape, last body that moves both shapes) of each checked pair.

        If the index of the second shape is negative, the second shape is an obstacle.
        """
        own, others = np.array(self.checks).T
        others = others - len(self.obstacles)
        common = [
            self.hulls.common(i, j) if j >= 0 else 0 for i, j in zip(own, others, strict=True)
        ]
        return own, others, np.array(common)


def configuration_space(
    robot: Robot,
    obstacles: Sequence[Obstacle] = (),
    *,
    radius: float | Sequence[float],
    allowed_collisions: Sequence[tuple[str, str]] = (),
) -> ConfigurationSpace:
    """Return the configuration space of a robot among obstacles, for planners such as `prm`.

    Args:
        robot: The robot.
        obstacles: Obstacles from `sphere`, `box`, `capsule` or `mesh`.
        radius: Radius by which the lines and plates of the robot's drawing are thickened [m]. One
            number for all bodies, or a sequence with one number for each of
            `ConfigurationSpace.bodies`.
        allowed_collisions: Pairs of names from `ConfigurationSpace.bodies` whose contact is
            ignored.

    Raises:
        InputValueError: A prismatic coordinate of the robot has no limits. A radius is not above 0.
            `allowed_collisions` contains an unknown body. The joint motion of a robot with loops
            cannot be bounded. No pair of shapes remains for the collision checks.
        ShapeError: `radius` is a sequence, and its length differs from the number of bodies.
    """
    check_type("configuration_space: robot", robot, Robot)
    lower, upper = _box(robot)
    hulls = hulls_of(robot)
    radii, bodies = real("configuration_space: radius", radius), hulls.parts
    if radii.shape not in ((), (len(bodies),)):
        raise ShapeError(
            f"radius: expected one number, or {len(bodies)} for {', '.join(bodies)}, got shape "
            f"{radii.shape}"
        )
    radii = np.broadcast_to(radii, (len(bodies),))
    if not ((radii > 0) & np.isfinite(radii)).all():
        raise InputValueError(f"radius: expected values above 0, got {radius}")
    bounds = loop_bounds(robot, lower, upper) if robot.loops else None
    for name in (name for pair in allowed_collisions for name in pair):
        if name not in bodies:
            raise InputValueError(
                f"allowed_collisions: {robot.name} has no body {name!r}, only {', '.join(bodies)}"
            )
    space = ConfigurationSpace(robot, tuple(obstacles), hulls, radii, lower, upper, (), bounds)
    space = _checked(space, [set(pair) for pair in allowed_collisions])
    if not space.checks:
        raise InputValueError(f"{robot.name}: there are no pairs of shapes to check")
    return space


def _box(robot: Robot) -> tuple[FloatArray, FloatArray]:
    """Return the (smallest, largest) coordinates (n,) of the configuration space.

    An unlimited actuator of a loop may rotate by half a turn in both directions from the reference
    configuration.
    """
    lower, upper = box_of(robot)
    if robot.reference is not None:
        endless = np.isinf(robot.lower) & np.isinf(robot.upper)
        middle = np.array(robot.reference.q)
        lower = np.where(endless, middle - np.pi, lower)
        upper = np.where(endless, middle + np.pi, upper)
    return lower, upper


def _checked(space: ConfigurationSpace, allowed_collisions: list[set[str]]) -> ConfigurationSpace:
    """Return a copy of the space in which `checks` contains the pairs of shapes to check.

    A pair of shapes is not checked if both are on one body, or if a joint connects their bodies.

    A pair of shapes that touches in each of many random configurations is not checked.
    """
    hulls, first = space.hulls.hulls, len(space.obstacles)
    together = joined(space.hulls.skeleton) + allowed_collisions
    pairs = [
        (b, first + a)
        for a, b in combinations(range(len(hulls)), 2)
        if hulls[a].part != hulls[b].part and {hulls[a].part, hulls[b].part} not in together
    ]
    _, z = closed_configurations(space.robot, space.lower, space.upper)
    among = replace(space, checks=tuple(pairs))
    apart = np.asarray((among._distances_at(z) > 0).any(0))
    moving = [k for k, hull in enumerate(hulls) if hull.bodies.any()]
    near = [(k, i) for k in moving for i in range(first)]
    own = [pair for pair, is_apart in zip(pairs, apart, strict=True) if is_apart]
    return replace(space, checks=tuple(near + own))
