"""Planar regions bounded by circular arcs, and regions swept by their rotation.

The border of a region is computed from candidate arcs. The candidate arcs include all arcs of the
border, and are cut at their intersections. A piece of a candidate arc belongs to the border if the
region lies on exactly one side of the piece. Let a region rotate about a point by angles from a to
b. Candidate arcs of the swept region are the border rotated by a, the border rotated by b, and arcs
about the rotation center. The arcs about the rotation center belong to circles that touch the
border or pass through its corners.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chasles.summaries import summary_repr

from ..tolerances import SAME_ARC, TANGENT, TEST_DISTANCE
from .annuli import BorderArc

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_TURN = 2 * math.pi
_BLOCK = 20_000
"""Maximum number of point-arc pairs in one batch, so that the arrays fit in the processor cache."""
_RAY = 0.7548776662466927
"""Direction [rad] of the rays that test whether a region contains a point. Rays in this uncommon
direction are rarely tangent to arcs."""


@dataclass(frozen=True, eq=False)
class ArcRegion:
    """A planar set of points that is defined by circular arcs.

    The set is a region bounded by arcs, a curve that consists of arcs, or a point. A single point
    is represented by an arc of radius 0.

    Attributes:
        arcs: The directed border arcs, with the region on the left of each arc.
        solid: Whether the points enclosed by the arcs belong to the region.
    """

    arcs: tuple[BorderArc, ...]
    solid: bool = True

    def __repr__(self) -> str:
        """Short summary with the main values."""
        corners = [f"({a:.4g}, {b:.4g})" for a, b in self.bounds] if self.arcs else []
        where = f"from {' to '.join(corners)} m" if corners else ""
        facts = (f"{len(self.arcs)} arcs", f"area {self.area:.12g} m^2", where)
        return summary_repr(self, "", *facts, methods="contains(points)")

    @property
    def area(self) -> float:
        """The area of the region [m^2], exact up to rounding errors."""
        return sum(arc.twice_area for arc in self.arcs) / 2 if self.solid else 0.0

    @property
    def bounds(self) -> FloatArray:
        """(2, 2) smallest and largest x and y of the region [m]."""
        points = np.concatenate([_extremes(arc) for arc in self.arcs])
        return np.array([points.min(0), points.max(0)])

    def contains(self, points: FloatArray) -> BoolArray:
        """Return whether the arcs enclose points (m, 2), by counting arcs that a ray crosses."""
        if not self.arcs:
            return np.zeros(len(points), dtype=bool)
        parts = np.array_split(points, max(1, len(points) * len(self.arcs) // _BLOCK))
        return np.concatenate([self._contains(part) for part in parts])

    def _contains(self, points: FloatArray) -> BoolArray:
        centers, radii, starts, widths = self._rows
        along = np.array([math.cos(_RAY), math.sin(_RAY)])
        step = points[:, None] - centers
        middle = step @ along
        with np.errstate(invalid="ignore"):
            half = np.sqrt(middle**2 - (step**2).sum(-1) + radii**2)
            crossings = np.zeros(len(points), dtype=np.int64)
            for distance in (-middle - half, -middle + half):
                x, y = np.moveaxis(step + distance[..., None] * along, -1, 0)
                on_arc = (np.arctan2(y, x) - starts) % _TURN <= widths
                crossings += ((distance > 0) & on_arc).sum(1)
        return np.asarray(crossings % 2 == 1)

    @cached_property
    def _rows(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Centers (k, 2), radii (k,), smallest angles (k,) and angular widths (k,) of the arcs."""
        rows = [(*a.center, a.radius, min(a.start, a.end), abs(a.end - a.start)) for a in self.arcs]
        table = np.array(rows, dtype=np.float64).reshape(-1, 5)
        return table[:, :2], table[:, 2], table[:, 3], table[:, 4]

    def moment(self) -> float:
        """Return the integral of x over the part of the region with x > 0 [m^3].

        By Green's theorem, the area integral of x is the integral of max(x, 0)^2 / 2 dy along the
        border.
        """
        return sum(_moment(arc) for arc in self.arcs)

    def mirrored(self) -> ArcRegion:
        """Return the mirror image of the region at the line x = 0."""
        arcs = [
            BorderArc(arc.center * [-1, 1], arc.radius, math.pi - arc.end, math.pi - arc.start)
            for arc in self.arcs
        ]
        return ArcRegion(tuple(arcs), self.solid)


def swept(region: ArcRegion, center: FloatArray, lower: float, upper: float) -> ArcRegion:
    """Return the region that another region sweeps in a rotation about a point.

    Args:
        region: The rotating region.
        center: (2,) the center of rotation [m].
        lower: The smallest angle of the rotation [rad].
        upper: The largest angle of the rotation [rad]. An angle range of a full turn or more
            includes all angles.
    """
    is_circle = not upper - lower < _TURN
    if len(region.arcs) == 1 and region.arcs[0].radius == 0:
        return _swept_point(region.arcs[0].center - center, center, lower, upper)
    candidates = [
        BorderArc(center, radius, *((0.0, _TURN) if is_circle else (start + lower, start + upper)))
        for arc in region.arcs
        for radius, start in _touching(arc, center)
    ]
    if not is_circle:
        candidates += [_turned(arc, center, by) for arc in region.arcs for by in (lower, upper)]

    def inside(points: FloatArray) -> BoolArray:
        x, y = (points - center).T
        angles = np.arctan2(y, x)
        pieces = _angles(region, center, np.hypot(x, y))
        return np.array(
            [
                any(
                    is_circle or (angle - a - lower) % _TURN <= b - a + upper - lower
                    for a, b in own
                )
                for angle, own in zip(angles.tolist(), pieces, strict=True)
            ],
            dtype=bool,
        )

    return bounded(candidates, inside)


def bounded(
    candidates: Sequence[BorderArc], inside: Callable[[FloatArray], BoolArray]
) -> ArcRegion:
    """Return the region whose border consists of parts of the candidate arcs.

    Args:
        candidates: Arcs that contain the whole border of the region.
        inside: Function that tests whether points (m, 2) belong to the region.
    """
    size = max(arc.radius + float(np.abs(arc.center).max()) for arc in candidates)
    circles = _circles(candidates, size)
    ends = np.array([point for arc in candidates for point in _ends(arc)])
    others = (
        np.array([arcs[0].center for arcs in circles]).reshape(-1, 2),
        np.array([arcs[0].radius for arcs in circles]),
    )
    pieces, tested = [], []
    for arcs in circles:
        center, radius = arcs[0].center, arcs[0].radius
        for a, b in itertools.pairwise(_cuts(arcs, others, ends, SAME_ARC * size)):
            middle = (a + b) / 2
            if (b - a) * radius <= SAME_ARC * size or not any(_covers(x, middle) for x in arcs):
                continue
            aside = min(TEST_DISTANCE * size, TEST_DISTANCE**0.5 * (b - a) * radius)
            along = np.array([math.cos(middle), math.sin(middle)])
            pieces.append((center, radius, a, b))
            tested += [center + (radius + by) * along for by in (-aside, aside)]
    sides = inside(np.array(tested).reshape(-1, 2)).reshape(-1, 2)
    found = [
        BorderArc(center, radius, *((a, b) if within else (b, a)))
        for (center, radius, a, b), (within, beyond) in zip(pieces, sides, strict=True)
        if within != beyond
    ]
    return ArcRegion(tuple(found))


def united(first: ArcRegion, second: ArcRegion) -> ArcRegion:
    """Return the union of two regions."""
    arcs = [*first.arcs, *second.arcs]
    return bounded(arcs, lambda p: first.contains(p) | second.contains(p)) if arcs else first


def common(first: ArcRegion, second: ArcRegion) -> ArcRegion:
    """Return the intersection of two regions."""
    arcs = [*first.arcs, *second.arcs]
    if not arcs:
        return first
    return bounded(arcs, lambda p: first.contains(p) & second.contains(p))


def _swept_point(step: FloatArray, center: FloatArray, lower: float, upper: float) -> ArcRegion:
    """Return the arc that a point sweeps about a center."""
    radius, angle = math.hypot(*step), math.atan2(step[1], step[0])
    ends = (angle + lower, angle + upper) if upper - lower < _TURN else (0.0, _TURN)
    return ArcRegion((BorderArc(center, radius, *ends),), solid=False)


def _turned(arc: BorderArc, center: FloatArray, by: float) -> BorderArc:
    c, s = math.cos(by), math.sin(by)
    turned = center + np.array([[c, -s], [s, c]]) @ (arc.center - center)
    return BorderArc(turned, arc.radius, arc.start + by, arc.end + by)


def _touching(arc: BorderArc, center: FloatArray) -> Iterable[tuple[float, float]]:
    """Yield (radius, angle) of points where circles about a center touch an arc or its ends."""
    away = arc.center - center
    outward = math.atan2(away[1], away[0])
    angles = [arc.start, arc.end]
    angles += [angle for angle in (outward, outward + math.pi) if _covers(arc, angle)]
    for angle in angles:
        x, y = away + arc.radius * np.array([math.cos(angle), math.sin(angle)])
        yield math.hypot(x, y), math.atan2(y, x)


def _angles(
    region: ArcRegion, center: FloatArray, radii: FloatArray
) -> list[list[tuple[float, float]]]:
    """Return, for each circle about a center, the angle intervals in which it lies in a region."""
    centers, own, starts, widths = region._rows
    angles, on_arcs = _crossings(center, radii[:, None], centers, own)
    with np.errstate(invalid="ignore"):
        kept = (on_arcs - starts) % _TURN <= widths
    cuts = [np.sort(angles[:, k][kept[:, k]] % _TURN).tolist() for k in range(len(radii))]
    if not region.solid:
        return [[(angle, angle) for angle in row] for row in cuts]
    pieces = [
        list(itertools.pairwise([*row, row[0] + _TURN] if row else [0.0, _TURN])) for row in cuts
    ]
    middles = np.array([(a + b) / 2 for row in pieces for a, b in row])
    radius = np.repeat(radii, [len(row) for row in pieces])[:, None]
    points = center + radius * np.column_stack([np.cos(middles), np.sin(middles)])
    inside = iter(region.contains(points).tolist())
    return [[piece for piece in row if next(inside)] for row in pieces]


def _crossings(
    center: FloatArray, radius: float | FloatArray, centers: FloatArray, radii: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the intersections of one circle with k circles, as angles [rad] on both circles.

    Tangent circles do not count as crossing, because rounding errors could create or remove their
    intersections.

    Each array of angles has the shape (2, ..., k), because two circles have up to two
    intersections. The angles are NaN if two circles do not intersect.
    """
    step = centers - center
    d = np.hypot(step[:, 0], step[:, 1])
    with np.errstate(invalid="ignore", divide="ignore"):
        cosine = (radius**2 + d**2 - radii**2) / (2 * radius * d)
        half = np.where(np.abs(cosine) < 1 - TANGENT, np.arccos(cosine), np.nan)
    towards = np.arctan2(step[:, 1], step[:, 0])
    angles = np.stack([towards - half, towards + half])
    x, y = radius * np.cos(angles) - step[:, 0], radius * np.sin(angles) - step[:, 1]
    return angles, np.arctan2(y, x)


def _circles(arcs: Iterable[BorderArc], size: float) -> list[list[BorderArc]]:
    """Group arcs by their circles.

    Circles that differ only by rounding errors count as equal.
    """
    found: list[list[BorderArc]] = []
    for arc in arcs:
        if arc.radius <= SAME_ARC * size:
            continue
        for own in found:
            off = math.hypot(*(own[0].center - arc.center)) + abs(own[0].radius - arc.radius)
            if off <= SAME_ARC * size:
                own.append(arc)
                break
        else:
            found.append([arc])
    return found


def _cuts(
    arcs: list[BorderArc], others: tuple[FloatArray, FloatArray], ends: FloatArray, slack: float
) -> list[float]:
    """Return the ascending angles at which a circle crosses other circles or contains arc ends."""
    own = arcs[0]
    angles = [angle for arc in arcs for angle in (arc.start, arc.end)]
    across = _crossings(own.center, own.radius, *others)[0]
    angles += across[np.isfinite(across)].tolist()
    x, y = (ends - own.center).T
    touching = np.abs(np.hypot(x, y) - own.radius) <= slack
    angles += [float(angle) for angle in np.arctan2(y[touching], x[touching])]
    ascending = sorted(angle % _TURN for angle in angles)
    return [*ascending, ascending[0] + _TURN]


def _ends(arc: BorderArc) -> FloatArray:
    """Return the start and end points (2, 2) of an arc."""
    angles = np.array([arc.start, arc.end])
    return np.asarray(arc.center + arc.radius * np.column_stack([np.cos(angles), np.sin(angles)]))


def _covers(arc: BorderArc, angle: Any) -> Any:
    """Return whether an arc includes an angle [rad], or False if the angle is NaN."""
    start, end = min(arc.start, arc.end), max(arc.start, arc.end)
    return (angle - start) % _TURN <= end - start


def _extremes(arc: BorderArc) -> FloatArray:
    """Return the end points of an arc and its extreme points in x and y, as an array (k, 2)."""
    angles = [arc.start, arc.end]
    angles += [k * math.pi / 2 for k in range(4) if _covers(arc, k * math.pi / 2)]
    return np.asarray(arc.center + arc.radius * np.column_stack([np.cos(angles), np.sin(angles)]))


def _moment(arc: BorderArc) -> float:
    """Integrate max(x, 0)^2 / 2 dy along an arc x = c + r cos t, with dy = r cos t dt."""
    c, r = float(arc.center[0]), arc.radius
    least, most = min(arc.start, arc.end), max(arc.start, arc.end)
    cuts = [least, most]
    if abs(c) < r:
        at_zero = math.acos(-c / r)
        cuts += [least + (t - least) % _TURN for t in (at_zero, -at_zero) if _covers(arc, t)]

    def integral(t: float) -> float:
        sine = math.sin(t)
        squares = t / 2 + math.sin(2 * t) / 4
        return c * c * sine + 2 * c * r * squares + r * r * (sine - sine**3 / 3)

    total = sum(
        integral(b) - integral(a)
        for a, b in itertools.pairwise(sorted(cuts))
        if c + r * math.cos((a + b) / 2) > 0
    )
    return math.copysign(r / 2, arc.end - arc.start) * total
