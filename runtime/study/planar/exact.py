"""Workspaces with exact borders: arms whose joints move the tool's origin in a plane.

Where the axes that move the origin are parallel, it stays in a plane, or in a prism with slides
along the axes. Where the first axis is vertical and the others are normal to a plane through it,
the workspace is a body of revolution, and its section by that plane is found. In both cases the
section is what a point sweeps by turning about one axis after the other, from the tool to the
base, each within its limits; its border consists of arcs.

Behind the axis, at r < 0, the section belongs to the opposite side. With m+ and m- the integrals of
|r| over the parts in front and behind, and m for what they have in common once one is mirrored, a
base that turns by s fills

    V = s (m+ + m-) - max(0, 2 (s - pi)) m        (s at most one turn)
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import InputValueError
from ...tolerances import SAME_ARC
from .annuli import BorderArc
from .arc_regions import ArcRegion, common, swept

FloatArray = NDArray[np.float64]

_TURN = 2 * math.pi
_POSTURES = 8
"""Postures at which a joint that does not move the origin leaves it at rest."""


@dataclass(frozen=True, eq=False)
class ExactWorkspace:
    """The exact workspace of the tool's origin.

    Attributes:
        robot: The robot's name.
        section: The region in the plane; of a body of revolution, in (r, z) at each angle of the
            base, r < 0 behind the axis.
        origin: (3,) origin of the plane [m], on the first axis for a body of revolution.
        axes: (2, 3) directions of the plane's two axes in the base frame, with the base at 0.
        turn: (2,) least and largest angle of the base [rad]; None where the tool stays in a plane.
        height: (2,) least and largest way of slides normal to the plane [m].
    """

    robot: str
    section: ArcRegion
    origin: FloatArray
    axes: FloatArray
    turn: FloatArray | None
    height: FloatArray

    @property
    def area(self) -> float:
        """The area of the section [m^2], exact to rounding."""
        return self.section.area

    @property
    def volume(self) -> float:
        """The volume [m^3], exact to rounding; 0 of a flat workspace."""
        if self.turn is None:
            return self.area * float(np.ptp(self.height))
        span = min(float(np.ptp(self.turn)), _TURN)
        mirrored = self.section.mirrored()
        either = self.section.moment() + mirrored.moment()
        if span <= math.pi:
            return span * either
        return span * either - 2 * (span - math.pi) * common(self.section, mirrored).moment()

    @property
    def extents(self) -> FloatArray:
        """(2, 3) least and largest x, y and z [m], exact to rounding."""
        (u_0, v_0), (u_1, v_1) = self.section.extents
        if self.turn is None:
            normal = np.cross(*self.axes)
            p = self.origin + np.array([_along(self.section, axis) for axis in self.axes.T]).T
            slides = np.sort(np.outer(self.height, normal), axis=0)
            return np.asarray(p + slides)
        towards = math.atan2(self.axes[0, 1], self.axes[0, 0])
        x = np.outer([u_0, u_1], _cosine_ends(self.turn + towards))
        y = np.outer([u_0, u_1], _cosine_ends(self.turn + towards - math.pi / 2))
        ends = np.array([[x.min(), y.min(), v_0], [x.max(), y.max(), v_1]])
        return np.asarray(self.origin + ends)

    def plot(self, ax: Any = None) -> Any:
        """Draws the section's border; returns the matplotlib axes."""
        from ..pictures import plot_section  # noqa: PLC0415

        return plot_section(self, ax)


def exact_workspace(robot: Any) -> ExactWorkspace:
    """The exact workspace of an arm whose joints move the tool's origin in a plane.

    Args:
        robot: A serial arm. Joints that leave the tool's origin at rest, such as a roll about the
            tool, do not count. The others are parallel revolute joints and slides along them; or a
            vertical first axis, and revolute ones normal to a plane through it and the tool.

    Raises:
        InputValueError: The arm is not of that kind.
    """
    if robot.loops:
        raise InputValueError(f"{robot.name}: exact_workspace takes serial arms, this has loops")
    chain = _Chain.of(robot)
    flat = chain if chain.parallel else None
    rest = chain if flat else chain.without_first()
    if not (flat or (rest.parallel and _vertical(chain, rest))):
        raise InputValueError(
            f"{robot.name}: expected parallel axes, or a vertical first axis and parallel ones "
            "normal to a plane through it and the tool"
        )
    n = rest.directions[rest.turns][0]
    axes = _plane(n) if flat else np.array([np.cross([0, 0, 1.0], n), [0, 0, 1.0]])
    origin = np.zeros(3) if flat else chain.points[0] * [1, 1, 0]
    section = ArcRegion((BorderArc(axes @ (rest.tool - origin), 0.0, 0.0, 0.0),), solid=False)
    for k in np.flatnonzero(rest.turns)[::-1]:
        by = np.sort(rest.limits[k] * (rest.directions[k] @ n))
        section = swept(section, axes @ (rest.points[k] - origin), *by)
    slides = ~rest.turns
    along = rest.limits[slides] * (rest.directions[slides] @ n)[:, None]
    height = np.sort(along, axis=1).sum(0)
    if flat:
        origin = n * (rest.tool @ n)
        return ExactWorkspace(robot.name, section, origin, axes, None, height)
    turn = np.sort(chain.limits[0] * chain.directions[0, 2])
    return ExactWorkspace(robot.name, section, origin, axes, turn, height)


@dataclass(frozen=True, eq=False)
class _Chain:
    """The joints that move the tool's origin, at one posture; limits are counted from there."""

    directions: FloatArray
    points: FloatArray
    turns: NDArray[np.bool_]
    limits: FloatArray
    tool: FloatArray

    @classmethod
    def of(cls, robot: Any) -> _Chain:
        """The chain of a robot, in the middle of its limits."""
        bounded = np.isfinite(robot.lower) & np.isfinite(robot.upper)
        inside = (np.where(bounded, robot.lower, 0) + np.where(bounded, robot.upper, 0)) / 2
        rng = np.random.default_rng(0)
        some = inside + rng.uniform(-1, 1, (_POSTURES, robot.n))
        moving = np.abs(robot.jacobian_mixed(some)[:, :3]).max((0, 1)) > SAME_ARC
        S = robot.jacobian_space(inside).T[moving]
        turns = np.linalg.norm(S[:, 3:], axis=1) > SAME_ARC
        directions = np.where(turns[:, None], S[:, 3:], S[:, :3])
        limits = np.column_stack([robot.lower - inside, robot.upper - inside])[moving]
        points = np.cross(S[:, 3:], S[:, :3])
        return cls(directions, points, turns, limits, robot.fk(inside)[:3, 3])

    @property
    def parallel(self) -> bool:
        """Whether all axes are parallel, and there are two that turn."""
        if self.turns.sum() < 2:  # noqa: PLR2004 - one turns a point on a circle
            return False
        n = self.directions[self.turns][0]
        return bool(np.abs(np.cross(self.directions, n)).max() <= SAME_ARC)

    def without_first(self) -> _Chain:
        """The chain from the second joint on."""
        rest = slice(1, None)
        return _Chain(
            self.directions[rest], self.points[rest], self.turns[rest], self.limits[rest], self.tool
        )


def _vertical(chain: _Chain, rest: _Chain) -> bool:
    """Whether the first axis is vertical and in the plane in which the others move the tool."""
    first, n = chain.directions[0], rest.directions[0]
    upright = chain.turns[0] and abs(abs(first[2]) - 1) <= SAME_ARC and rest.turns.all()
    aside = abs((rest.tool - chain.points[0]) @ n) <= SAME_ARC
    return bool(upright and abs(first @ n) <= SAME_ARC and aside)


def _plane(n: FloatArray) -> FloatArray:
    """Two directions normal to a third one: x and y of the base where it is z."""
    least = np.eye(3)[int(np.argmin(np.abs(n)))]
    u = least - (least @ n) * n
    u /= np.linalg.norm(u)
    return np.array([u, np.cross(n, u)])


def _along(section: ArcRegion, direction: FloatArray) -> FloatArray:
    """(2,) least and largest value of direction @ (u, v) over a section."""
    size = math.hypot(*direction)
    if size <= SAME_ARC:
        return np.zeros(2)
    by = -math.atan2(direction[1], direction[0])
    c, s = math.cos(by), math.sin(by)
    turned = [
        BorderArc(np.array([[c, -s], [s, c]]) @ a.centre, a.radius, a.start + by, a.end + by)
        for a in section.arcs
    ]
    return np.asarray(size * ArcRegion(tuple(turned)).extents[:, 0])


def _cosine_ends(angles: FloatArray) -> tuple[float, float]:
    """Least and largest cosine between two angles [rad]."""
    lower, upper = angles
    values = [math.cos(lower), math.cos(upper)] if np.isfinite(angles).all() else []
    for k, value in ((0, 1.0), (1, -1.0)):
        if not upper - lower < _TURN or (k * math.pi - lower) % _TURN <= upper - lower:
            values.append(value)
    return min(values), max(values)
