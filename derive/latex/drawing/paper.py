"""Points on paper with integer coordinates, which make the layout exact and reproducible."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...chain.rigid_bodies import Array
from ...model.tolerances import LAYOUT_TIE, SAME_POINT

Point = tuple[int, int]
"""Coordinates on the page, to the right and upwards (0.1 mm)."""
WIDTH, HEIGHT = 1400, 1100
"""Maximum width and height of a picture (0.1 mm), including labels and scale bar."""
ROOM_ASIDE, ROOM_ABOVE, ROOM_BELOW = 120, 80, 150
"""Margins for labels."""


def rounded(value: float) -> int:
    """Round to the nearest integer.

    Values whose fractional part is within ``LAYOUT_TIE`` of 0.5 are rounded up.
    """
    return math.floor(value + 0.5 + LAYOUT_TIE)


@dataclass(frozen=True)
class Paper:
    """A projection of the robot onto the page, with its scale.

    Attributes:
        view: Directions to the right, upwards and towards the eye, as rows of a matrix (3, 3).
        scale: Length in the drawing, in tenths of a millimeter, that represents one meter.
        corner: The lower left corner of the page, in view coordinates (meter).
    """

    view: Array
    scale: float
    corner: tuple[float, float]

    @classmethod
    def around(cls, view: Array, points: Sequence[Array]) -> "Paper":
        """Return the projection with the largest scale at which the points fit on the page."""
        seen = np.array(points) @ view[:2].T
        low, high = seen.min(axis=0), seen.max(axis=0)
        free = (WIDTH - 2 * ROOM_ASIDE, HEIGHT - ROOM_ABOVE - ROOM_BELOW)
        spans = zip(free, (float(span) for span in high - low), strict=True)
        scale = min((room / span for room, span in spans if span > SAME_POINT), default=WIDTH)
        middle = (low[0] + high[0]) / 2
        return cls(view, scale, (middle - WIDTH / 2 / scale, low[1] - ROOM_BELOW / scale))

    def at(self, point: Array) -> Point:
        """Project a point in the base frame onto the page."""
        x, y = self.view[:2] @ point
        return rounded(self.scale * (x - self.corner[0])), rounded(
            self.scale * (y - self.corner[1])
        )

    def along(self, direction: Array) -> tuple[float, float, float]:
        """Return the components of a direction in view coordinates, rounded to six decimals."""
        right, up, near = (rounded(1e6 * float(part)) / 1e6 for part in self.view @ direction)
        return right, up, near

    def depth(self, points: Sequence[Array]) -> int:
        """Return the mean depth of points along the view direction, in units of 0.1 mm."""
        return rounded(self.scale * float(np.mean(np.array(points) @ self.view[2])))


def number(tenths: int) -> str:
    """Format a length (0.1 mm) in millimeters."""
    sign = "-" if tenths < 0 else ""
    millimeters, rest = divmod(abs(tenths), 10)
    return f"{sign}{millimeters}.{rest}" if rest else f"{sign}{millimeters}"


def at(point: Point) -> str:
    """Format a point for TikZ."""
    return f"({number(point[0])},{number(point[1])})"


def angle(x: float, y: float) -> str:
    """Format the direction of a vector in degrees with two decimals."""
    hundredths = rounded(100 * math.degrees(math.atan2(y, x))) % 36000
    return f"{hundredths / 100:g}"


def distance(a: Point, b: Point) -> int:
    """Return the distance between two points."""
    return rounded(math.sqrt((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2))


def between(a: Point, b: Point, share: float) -> Point:
    """Return the point at the fraction ``share`` of the way from ``a`` to ``b``."""
    return rounded(a[0] + share * (b[0] - a[0])), rounded(a[1] + share * (b[1] - a[1]))


def turn(a: Point, b: Point, c: Point) -> int:
    """Return twice the signed area of a triangle, which is positive if counterclockwise."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def hull(points: Sequence[Point]) -> list[Point]:
    """Return the corners of the convex hull in counterclockwise order.

    If all points are on a line, the convex hull has the two end points as corners.
    """
    ordered = sorted(set(points))
    if len(ordered) < 3:  # noqa: PLR2004
        return ordered
    lower, upper = _half(ordered), _half(ordered[::-1])
    return lower[:-1] + upper[:-1]


def _half(ordered: Sequence[Point]) -> list[Point]:
    corners: list[Point] = []
    for point in ordered:
        while len(corners) > 1 and turn(corners[-2], corners[-1], point) <= 0:
            corners.pop()
        corners.append(point)
    return corners


def area(corners: Sequence[Point]) -> int:
    """Return twice the signed area of a polygon, which is positive if counterclockwise."""
    return sum(
        a[0] * b[1] - a[1] * b[0]
        for a, b in zip(corners, [*corners[1:], *corners[:1]], strict=True)
    )


def is_inside(point: Point, corners: Sequence[Point]) -> bool:
    """Whether a point is inside a polygon."""
    inside = False
    for a, b in zip(corners, [*corners[1:], *corners[:1]], strict=True):
        if (a[1] > point[1]) != (b[1] > point[1]) and (turn(a, b, point) > 0) == (b[1] > a[1]):
            inside = not inside
    return inside
