"""Workspaces with exact borders, for arms that move a point in a plane.

If the joint axes that move a point are parallel, the workspace of the point is planar. If prismatic
joints also move the point parallel to the revolute axes, the workspace is a prism. If parallel
horizontal axes follow a vertical first axis, the workspace is a body of revolution. The plane in
which the parallel axes move the point may be offset from the first axis. The section of the
workspace is swept by the rotations about the parallel axes, one by one from the tip to the base.
The border of each swept region consists of circular arcs. `meridian.py` computes the volumes of
bodies of revolution.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from chasles import InputValueError, Robot
from chasles.contract import check_type
from chasles.summaries import summary_repr

from ..results import StudyResult, ranges
from ..tolerances import SAME_ARC
from .annuli import BorderArc
from .arc_regions import ArcRegion, swept
from .axes import MovingAxes, of_meetings, of_tool
from .meridian import Meridian, meridian, swept_volume

FloatArray = NDArray[np.float64]

Point = Literal["tool", "wrist"]

_TURN = 2 * math.pi


@dataclass(frozen=True, eq=False)
class ExactWorkspace(StudyResult):
    """The exact region that the tool origin or the wrist center of an arm reaches.

    Attributes:
        robot: The robot's name.
        point: "tool" for the tool origin, or "wrist" for the wrist center.
        joints: The names of the joints that move the point.
        section: The reachable region in a plane, with coordinates along `axes` [m]. For a body of
            revolution, the first coordinate is 0 at the points nearest to the first axis, and
            negative on the far side of this axis. For a body of revolution, the second coordinate
            is z.
        origin: (3,) origin of the plane in the base frame [m]. For a body of revolution, the origin
            is a point on the first axis.
        axes: (2, 3) unit vectors along the two axes of the plane in the base frame, with the first
            joint at position 0.
        offset: Distance of the plane from the first axis [m], positive along axes[0] x axes[1]. For
            a planar workspace, the offset is 0.
        turn: (2,) limits of the first joint [rad], or None for a planar workspace.
        height: (2,) limits of the prismatic motion normal to the plane [m].
    """

    _parts = (ArcRegion, BorderArc)

    robot: str
    point: Point
    joints: tuple[str, ...]
    section: ArcRegion
    origin: FloatArray
    axes: FloatArray
    offset: float
    turn: FloatArray | None
    height: FloatArray

    def __repr__(self) -> str:
        """Short summary with the main values."""
        return summary_repr(
            self,
            self.robot,
            f"of the {self.point}, moved by {', '.join(self.joints)}",
            ranges(self.bounds),
            f"section {self.area:.12g} m^2, volume {self.volume:.12g} m^3",
            methods=f"section, {'' if self.turn is None else 'meridian, '}plot(), save(path)",
        )

    @property
    def area(self) -> float:
        """The area of the workspace section [m^2], exact up to rounding errors."""
        return self.section.area

    @cached_property
    def volume(self) -> float:
        """The workspace volume [m^3] with relative error 1e-12, or 0 for a planar workspace."""
        if self.turn is None:
            return self.area * float(np.ptp(self.height))
        return swept_volume(self.section, self.offset, float(np.ptp(self.turn)))

    @cached_property
    def meridian(self) -> Meridian:
        """Return the meridian section in distances from the first axis and heights along this axis.

        Raises:
            InputValueError: The workspace is planar.
        """
        if self.turn is None:
            raise InputValueError(f"{self.robot}: the workspace is planar and has no meridian")
        return meridian(self.section, self.offset)

    @property
    def bounds(self) -> FloatArray:
        """(2, 3) smallest and largest x, y and z in the base frame [m], exact up to rounding."""
        (u_0, v_0), (u_1, v_1) = self.section.bounds
        if self.turn is None:
            normal = np.cross(*self.axes)
            p = self.origin + np.array([_along(self.section, axis) for axis in self.axes.T]).T
            slides = np.sort(np.outer(self.height, normal), axis=0)
            return np.asarray(p + slides)
        # At each angle of the first joint, x and y are linear in the section coordinate u.
        towards = math.atan2(self.axes[0, 1], self.axes[0, 0])
        ends = []
        for u in (u_0, u_1):
            rho, angle = math.hypot(u, self.offset), math.atan2(-self.offset, u)
            at = self.turn + towards + angle
            x, y = (_cosine_ends(at - normal) for normal in (0.0, math.pi / 2))
            ends.append(rho * np.array([x, y]).T)
        low, high = (np.array(ends)[:, k] for k in (0, 1))
        return np.asarray(self.origin + np.array([[*low.min(0), v_0], [*high.max(0), v_1]]))

    def plot(self, ax: Any = None) -> Any:
        """Draw the outline of the workspace section.

        Args:
            ax: The matplotlib axes, or None for a new figure.

        Returns:
            The axes.
        """
        from ..pictures import plot_section  # noqa: PLC0415

        return plot_section(self, ax)


def exact_workspace(robot: Robot, *, point: Point = "tool") -> ExactWorkspace:
    """Return the exact region that the tool origin or the wrist center of a serial arm reaches.

    The axes of the joints that move the point must have one of two arrangements:

    - All axes are parallel. Two or more joints are revolute, and the others are prismatic. The
      workspace is planar, or a prism if there is a prismatic joint.
    - All joints are revolute. The first axis is parallel to the z axis of the base frame. All
      further axes (two or more) are normal to the first axis and parallel to each other. The
      workspace is a body of revolution about the first axis.

    Args:
        robot: A serial arm. The joint limits bound the workspace.
        point: "tool" for the tool origin. "wrist" for an intersection of two consecutive axes, such
            as the center of a spherical wrist. Only the joints before these two axes move the
            wrist. If several intersections are possible, the wrist is the intersection nearest to
            the tool.

    Returns:
        An `ExactWorkspace`. `section` is the reachable region in a plane: the plane of the parallel
        motion, or a plane through the axis of revolution. `area` [m^2] is its area. `origin` (3,)
        [m] and the unit vectors `axes` (2, 3) describe the plane in the base frame. `volume` [m^3]
        is 0 for a planar workspace. `bounds` (2, 3) contains the smallest and largest x, y and z in
        the base frame [m]. `joints` names the joints that move the point.

    Raises:
        InputTypeError: `robot` is not a `Robot`.
        InputValueError: The robot has loops, `point` is neither "tool" nor "wrist", or the axes
            have neither of the two arrangements above. For "wrist", no two consecutive axes
            intersect.
    """
    check_type("exact_workspace: robot", robot, Robot)
    if robot.loops:
        raise InputValueError(f"{robot.name}: exact_workspace requires a serial arm, got loops")
    if point not in ("tool", "wrist"):
        raise InputValueError(f"exact_workspace: expected point 'tool' or 'wrist', got {point!r}")
    candidates = [of_tool(robot)] if point == "tool" else of_meetings(robot)
    chain = next((own for own in candidates if own.parallel or own.upright), None)
    if chain is None:
        other = "; the boundary for point='wrist' may consist of arcs" if point == "tool" else ""
        raise InputValueError(
            f"{robot.name}: {point}: the boundary does not consist of arcs, because the axes that "
            "move this point are neither parallel, nor a vertical axis followed by parallel "
            f"horizontal axes{other}; use workspace(), which accepts any arm"
        )
    flat = chain.parallel
    rest = chain if flat else chain.without_first()
    n = rest.directions[rest.turns][0]
    axes = _plane(n) if flat else np.array([np.cross([0, 0, 1.0], n), [0, 0, 1.0]])
    origin = n * (rest.place @ n) if flat else chain.points[0] * [1, 1, 0]
    section = _section(rest, n, axes, origin)
    slides = ~rest.turns
    along = rest.limits[slides] * (rest.directions[slides] @ n)[:, None]
    height = np.sort(along, axis=1).sum(0)
    turn, offset = None, 0.0
    if not flat:
        turn = np.sort(chain.limits[0] * chain.directions[0, 2])
        distance = float((rest.place - origin) @ np.cross(*axes))
        offset = distance if abs(distance) > SAME_ARC else 0.0
    return ExactWorkspace(
        robot.name, point, chain.names, section, origin, axes, offset, turn, height
    )


def _section(rest: MovingAxes, n: FloatArray, axes: FloatArray, origin: FloatArray) -> ArcRegion:
    """Return the region that the point sweeps by rotations about axes parallel to n."""
    section = ArcRegion((BorderArc(axes @ (rest.place - origin), 0.0, 0.0, 0.0),), solid=False)
    for k in np.flatnonzero(rest.turns)[::-1]:
        by = np.sort(rest.limits[k] * (rest.directions[k] @ n))
        section = swept(section, axes @ (rest.points[k] - origin), *by)
    return section


def _plane(n: FloatArray) -> FloatArray:
    """Return two perpendicular directions normal to n.

    For n = z, they are the x and y axes of the base.
    """
    least = np.eye(3)[int(np.argmin(np.abs(n)))]
    u = least - (least @ n) * n
    u /= np.linalg.norm(u)
    return np.array([u, np.cross(n, u)])


def _along(section: ArcRegion, direction: FloatArray) -> FloatArray:
    """Return the minimum and maximum (2,) of `direction @ (u, v)` for (u, v) in a section."""
    size = math.hypot(*direction)
    if size <= SAME_ARC:
        return np.zeros(2)
    by = -math.atan2(direction[1], direction[0])
    c, s = math.cos(by), math.sin(by)
    turned = [
        BorderArc(np.array([[c, -s], [s, c]]) @ a.center, a.radius, a.start + by, a.end + by)
        for a in section.arcs
    ]
    return np.asarray(size * ArcRegion(tuple(turned)).bounds[:, 0])


def _cosine_ends(angles: FloatArray) -> tuple[float, float]:
    """Return the minimum and maximum cosine of all angles in an interval (2,) [rad]."""
    lower, upper = angles
    values = [math.cos(lower), math.cos(upper)] if np.isfinite(angles).all() else []
    for k, value in ((0, 1.0), (1, -1.0)):
        if not upper - lower < _TURN or (k * math.pi - lower) % _TURN <= upper - lower:
            values.append(value)
    return min(values), max(values)
