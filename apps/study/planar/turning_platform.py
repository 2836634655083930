"""Workspaces of planar platforms for a range of angles.

At the platform angle phi, a leg restricts the tool to an annulus about c(phi) with inner radius a
and outer radius b. The center c(phi) moves on an arc of radius r about a point m. A leg reaches a
position at all angles if the position's distances from all points of the arc of c(phi) are between
a and b. Circles bound the region of such positions. The circles about the ends of the arc of c(phi)
have radii a and b. The circles about m have radii b - r, r + a and |r - a|. So circular arcs bound
the total workspace, which contains the positions that the tool reaches at all angles.

The inclusive workspace contains the positions that the tool reaches at some angle. The border of
the inclusive workspace also contains noncircular curves, on which two legs are at their limits. The
inclusive workspace is computed by subdividing squares. A square with half diagonal d is inside the
workspace if all legs reach its center at some angle phi with a margin of d. A square is outside the
workspace if, at each angle phi, its center is beyond the limits of some leg by more than d. Whether
a square is inside or outside the workspace is tested in closed form. A square that is neither
inside nor outside the workspace is subdivided. The error bound of the area is half the area of the
undecided squares.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chasles import InputValueError, Robot
from chasles.contract import check_type
from chasles.summaries import summary_repr

from ..grid import SizeEstimate
from ..results import StudyResult
from .annuli import BorderArc
from .arc_regions import ArcRegion, bounded
from .planar_platform import constant_orientation_workspace

FloatArray = NDArray[np.float64]

_TURN = 2 * math.pi
_ACROSS = 16
"""Initial number of squares along each side of the square that contains the inclusive workspace."""


@dataclass(frozen=True, eq=False)
class OrientationRangeWorkspace(StudyResult):
    """Positions that the tool of a planar platform reaches at angles of a range.

    Attributes:
        robot: The robot's name.
        angles: (2,) lower and upper end of the range of platform angles [rad].
        total: The region of tool positions that are reachable at every platform angle of the range.
            The area of this region is exact.
        inclusive: The area of tool positions that are reachable at one or more platform angles of
            the range [m^2], with an error bound.
    """

    _parts = (ArcRegion, BorderArc, SizeEstimate)

    robot: str
    angles: FloatArray
    total: ArcRegion
    inclusive: SizeEstimate

    def __repr__(self) -> str:
        """Short summary with the main values."""
        low, high = np.degrees(self.angles)
        return summary_repr(
            self,
            self.robot,
            f"angles from {low:.4g}° to {high:.4g}°",
            f"all of them on {self.total.area:.12g} m^2",
            f"some of them on {self.inclusive.value:.6g} ± {self.inclusive.error:.1g} m^2",
            methods="total, inclusive, plot(), save(path)",
        )

    def plot(self, ax: Any = None) -> Any:
        """Plot the border of the total workspace.

        Args:
            ax: The matplotlib axes, or None for a new figure.

        Returns:
            The axes.
        """
        from ..pictures import plot_total  # noqa: PLC0415

        return plot_total(self, ax)


def orientation_range_workspace(
    robot: Robot, phi_min: float, phi_max: float, *, tolerance: float = 1e-3
) -> OrientationRangeWorkspace:
    """Return the workspaces of a planar platform for a range of tool angles.

    The total workspace contains the positions that the tool reaches at every angle of a range. The
    inclusive workspace contains the positions that the tool reaches at one or more angles of the
    range.

    Args:
        robot: A planar platform with three legs. The tool moves in the x-y plane of the base frame
            and rotates about the z axis. Each leg is a chain of two links, or a cylinder with
            stroke limits.
        phi_min: The smallest angle of the tool about the z axis of the base frame [rad].
        phi_max: The largest angle of the tool [rad], above `phi_min`.
        tolerance: Relative error of the inclusive area at which the refinement stops, above 0.

    Returns:
        An `OrientationRangeWorkspace`. `total` is the region of the total workspace in the base
        frame [m]; its `area` [m^2] is exact up to rounding errors. `inclusive` is the area of the
        inclusive workspace (`value` and bound `error` [m^2]). If the tool reaches no position, both
        areas are 0.

    Raises:
        InputTypeError: `robot` is not a `Robot`.
        TypeError: An angle or the tolerance is not a real number.
        InputValueError: `phi_min` or `phi_max` is not finite, `phi_max` is not above `phi_min`, or
            `tolerance` is not above 0. The robot is not a planar platform with three legs. A leg is
            neither a chain of two links nor a cylinder. A cylinder of the robot has no stroke
            limits.

    Source:
        J.-P. Merlet, C. Gosselin, N. Mouly, Workspaces of planar parallel manipulators, 1998, for
        the kinds of workspaces.
    """
    check_type("orientation_range_workspace: robot", robot, Robot)
    if not -math.inf < phi_min < phi_max < math.inf or not tolerance > 0:
        raise InputValueError(
            f"orientation_range_workspace: expected phi_min < phi_max and tolerance > 0, got "
            f"{phi_min:g}, {phi_max:g} and {tolerance:g}"
        )
    legs = _legs(robot, phi_min, min(phi_max, phi_min + _TURN))
    return OrientationRangeWorkspace(
        robot.name, np.array([phi_min, phi_max]), _total(legs), _inclusive(legs, tolerance)
    )


@dataclass(frozen=True, eq=False)
class _Leg:
    """The annulus to which a leg restricts the tool.

    The center of the annulus moves on an arc as the platform rotates.
    """

    middle: FloatArray
    radius: float
    start: float
    width: float
    inner: float
    outer: float

    def centers(self, turned: FloatArray) -> FloatArray:
        """Return the annulus centers (k, 2) at angles (k,) from the start of the angle range."""
        angle = self.start + turned
        along = np.column_stack([np.cos(angle), np.sin(angle)])
        return np.asarray(self.middle + self.radius * along)

    def always(self, point: FloatArray) -> bool:
        """Return whether a point is in the annulus of the leg at every platform angle."""
        x, y = point - self.middle
        d, angle = math.hypot(x, y), math.atan2(y, x)
        ends = np.hypot(*(point - self.centers(np.array([0.0, self.width]))).T)
        nearest = abs(d - self.radius) if self._passes(angle) else ends.min()
        farthest = d + self.radius if self._passes(angle + math.pi) else ends.max()
        return bool(nearest >= self.inner and farthest <= self.outer)

    def circles(self) -> list[tuple[FloatArray, float]]:
        """Return the circles whose arcs bound the region that the leg reaches at every angle."""
        ends = self.centers(np.array([0.0, self.width]))
        found = [(end, radius) for end in ends for radius in (self.inner, self.outer)]
        about_middle = (
            self.outer - self.radius,
            self.radius + self.inner,
            abs(self.radius - self.inner),
        )
        return found + [(self.middle, radius) for radius in about_middle]

    def _passes(self, angle: float) -> bool:
        return (angle - self.start) % _TURN <= self.width


def _legs(robot: Robot, lower: float, upper: float) -> list[_Leg]:
    found = []
    angles = (lower, lower + math.pi)
    for here, across in zip(
        *(constant_orientation_workspace(robot, phi).pieces[0] for phi in angles), strict=True
    ):
        middle = (here.center + across.center) / 2
        x, y = here.center - middle
        start, radius = math.atan2(y, x), math.hypot(x, y)
        found.append(_Leg(middle, radius, start, upper - lower, here.inner, here.outer))
    return found


def _total(legs: list[_Leg]) -> ArcRegion:
    arcs = [
        BorderArc(center, radius, 0.0, _TURN)
        for leg in legs
        for center, radius in leg.circles()
        if radius > 0
    ]
    return bounded(
        arcs, lambda points: np.array([all(leg.always(p) for leg in legs) for p in points])
    )


def _inclusive(legs: list[_Leg], tolerance: float) -> SizeEstimate:
    """Return the area of the tool positions that all legs reach at some platform angle."""
    lower = np.max([leg.middle - leg.radius - leg.outer for leg in legs], axis=0)
    upper = np.min([leg.middle + leg.radius + leg.outer for leg in legs], axis=0)
    side = float((upper - lower).max()) / _ACROSS
    if side <= 0:
        return SizeEstimate(0.0, 0.0, "m^2")
    x, y = (low + side * (np.arange(_ACROSS) + 0.5) for low in lower)
    middles, inside = np.stack(np.meshgrid(x, y), -1).reshape(-1, 2), 0.0
    while len(middles):
        kept, left = _judged(legs, middles, side)
        inside += float(kept.sum()) * side**2
        open_area = float(left.sum()) * side**2
        if open_area / 2 <= tolerance * (inside + open_area / 2):
            return SizeEstimate(inside + open_area / 2, open_area / 2, "m^2")
        side /= 2
        corners = side / 2 * np.array([[-1, -1], [-1, 1], [1, -1], [1, 1]])
        middles = (middles[left][:, None] + corners).reshape(-1, 2)
    return SizeEstimate(inside, 0.0, "m^2")


def _judged(
    legs: list[_Leg], middles: FloatArray, side: float
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return masks of the squares inside the inclusive workspace and of the undecided squares."""
    half = side / math.sqrt(2)
    at_lower = _at_some_angle(legs, middles, -half)
    return at_lower, ~at_lower & _at_some_angle(legs, middles, half)


def _at_some_angle(legs: list[_Leg], points: FloatArray, slack: float) -> NDArray[np.bool_]:
    """Return, for each point (m, 2), whether all legs reach it at one common platform angle.

    The tolerance `slack` widens the annulus of each leg. The angles at which a leg reaches a point
    form intervals. Such an angle interval ends where the point is on the border of the leg's
    annulus, or at an end of the angle range. Only the ends of the angle intervals and the start of
    the angle range are tested.
    """
    first = np.zeros(len(points))
    found = _all_reach(legs, points, first, slack)
    for own in legs:
        x, y = (points - own.middle).T
        d, towards = np.hypot(x, y), np.arctan2(y, x)
        for radius in (own.inner - slack, own.outer + slack):
            with np.errstate(invalid="ignore", divide="ignore"):
                half = np.arccos((d**2 + own.radius**2 - radius**2) / (2 * d * own.radius))
            for angle in (towards - half, towards + half):
                turned = (angle - own.start) % _TURN
                others = [leg for leg in legs if leg is not own]
                within = (radius >= 0) & (turned <= own.width)
                found |= within & _all_reach(others, points, turned, slack)
    return found


def _all_reach(
    legs: list[_Leg], points: FloatArray, turned: FloatArray, slack: float
) -> NDArray[np.bool_]:
    """Return whether all legs reach points (m, 2) at angles (m,) from the start of the range."""
    reached = np.ones(len(points), dtype=bool)
    for leg in legs:
        d = np.linalg.norm(points - leg.centers(turned), axis=1)
        reached &= (d >= leg.inner - slack) & (d <= leg.outer + slack)
    return reached
