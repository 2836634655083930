"""Joint axes that move a specified point of a serial arm.

If two consecutive joint axes intersect, their joints do not move the intersection point. Examples
are the center of a spherical wrist and the intersection of axes 5 and 6 of a UR arm.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chasles import Robot

from ..tolerances import SAME_ARC

FloatArray = NDArray[np.float64]

_CONFIGURATIONS = 8
"""Number of random configurations for the test whether a joint moves a point."""


@dataclass(frozen=True, eq=False)
class MovingAxes:
    """The joints that move a point at one configuration.

    Attributes:
        names: Names of the joints that move the point.
        directions: (m, 3) directions of the joint axes in the base frame.
        points: (m, 3) point of each joint axis nearest to the origin of the base frame [m].
        turns: (m,) True for a revolute joint, False for a prismatic joint.
        limits: (m, 2) lower and upper limit of each joint, relative to its position at the
            configuration [rad or m].
        place: (3,) position of the moved point in the base frame [m].
    """

    names: tuple[str, ...]
    directions: FloatArray
    points: FloatArray
    turns: NDArray[np.bool_]
    limits: FloatArray
    place: FloatArray

    @property
    def parallel(self) -> bool:
        """Whether two or more of the joints are revolute, and all joint axes are parallel."""
        if self.turns.sum() < 2:  # noqa: PLR2004 - one joint moves a point on a circle
            return False
        n = self.directions[self.turns][0]
        return bool(np.abs(np.cross(self.directions, n)).max() <= SAME_ARC)

    @property
    def upright(self) -> bool:
        """Whether axis 1 is vertical, and the other axes move the point in a vertical plane."""
        rest = self.without_first()
        if not (self.turns.all() and rest.parallel):
            return False
        first, n = self.directions[0], rest.directions[0]
        return bool(abs(abs(first[2]) - 1) <= SAME_ARC and abs(first @ n) <= SAME_ARC)

    def without_first(self) -> MovingAxes:
        """Return the moving axes without the first axis."""
        rest = slice(1, None)
        return MovingAxes(
            self.names[rest],
            self.directions[rest],
            self.points[rest],
            self.turns[rest],
            self.limits[rest],
            self.place,
        )


def of_tool(robot: Robot) -> MovingAxes:
    """Return the joint axes that move the tool origin, at the middle of the joint limits."""
    configurations = _configurations(robot)
    places = robot.fk(configurations)[:, :3, 3]
    return _moving(robot, robot.jacobian_space(configurations), places)


def of_meetings(robot: Robot) -> Iterator[MovingAxes]:
    """For each intersection point of two consecutive axes, yield the axes that move this point.

    The pairs of intersecting axes come in order from the tool to the base.

    Let p + s a and p' + s' a' be the nearest points of two axes with the directions a and a'. The
    difference of the nearest points is normal to a and a'.
    """
    S = robot.jacobian_space(_configurations(robot))
    for j in range(robot.n - 1, 0, -1):
        (v, a), (w, b) = ((S[:, :3, k], S[:, 3:, k]) for k in (j - 1, j))
        n = np.cross(a, b)
        across = (n * n).sum(-1)
        if across.min() <= SAME_ARC:
            continue
        p, step = np.cross(a, v), np.cross(b, w) - np.cross(a, v)
        apart = np.abs((step * n).sum(-1)) / np.sqrt(across)
        if apart.max() <= SAME_ARC:
            along = (np.cross(step, b) * n).sum(-1) / across
            yield _moving(robot, S[..., : j - 1], p + along[:, None] * a)


def _configurations(robot: Robot) -> FloatArray:
    """Return the configuration in the middle of the joint limits, and random ones nearby."""
    bounded = np.isfinite(robot.lower) & np.isfinite(robot.upper)
    inside = (np.where(bounded, robot.lower, 0) + np.where(bounded, robot.upper, 0)) / 2
    some = inside + np.random.default_rng(0).uniform(-1, 1, (_CONFIGURATIONS, robot.n))
    return np.vstack([inside, some])


def _moving(robot: Robot, S: FloatArray, places: FloatArray) -> MovingAxes:
    """Return the joint axes that move a point, from space Jacobians (m, 6, k)."""
    speeds = S[:, :3] + np.cross(S[:, 3:], places[..., None], axis=1)
    moving = np.flatnonzero(np.abs(speeds).max((0, 1)) > SAME_ARC)
    v, omega = S[0, :3, moving], S[0, 3:, moving]
    turns = np.linalg.norm(omega, axis=1) > SAME_ARC
    inside = _configurations(robot)[0]
    limits = np.column_stack([robot.lower - inside, robot.upper - inside])[moving]
    names = tuple(robot.coordinates[k].name for k in moving)
    directions = np.where(turns[:, None], omega, v)
    return MovingAxes(names, directions, np.cross(omega, v), turns, limits, places[0])
