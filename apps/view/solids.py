"""Solids for the lines and symbols of a skeleton, with thickness and color.

The colors (Okabe and Ito, 2008) can be distinguished by color-blind readers.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import groupby, pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .triangles import Triangles, ball, box, box_on, joined, plate, tube

FloatArray = NDArray[np.float64]
Colour = tuple[int, int, int]

BLUE: Colour = (0, 114, 178)
YELLOW: Colour = (240, 228, 66)
VERMILION: Colour = (213, 94, 0)
GREEN: Colour = (0, 158, 115)
PURPLE: Colour = (204, 121, 167)
_LINK: Colour = (178, 190, 199)
_GROUND: Colour = (110, 115, 120)
_PASSIVE: Colour = (70, 75, 80)
_STRUT: Colour = (230, 159, 0)
_ROD: Colour = (222, 226, 230)

_THIN = 0.009
"""Radius of a link relative to the robot size. All sizes of joint symbols scale with this
radius."""
_SHORTEST = 1e-9
"""Minimum length of a line relative to its radius."""
_FRAME = 9.0
"""Length of the tool frame arrows, in link radii."""


@dataclass(frozen=True, eq=False)
class Solid:
    """A solid that is fixed to a body.

    Attributes:
        body: Index of the body in the skeleton.
        joint: Name of the actuated joint or strut that the solid represents, or "" for all other
            solids.
        colour: Red, green and blue from 0 to 255.
        triangles: The surface in the body's frame.
    """

    body: int
    joint: str
    colour: Colour
    triangles: Triangles


def solids(skeleton: Any, actuated: frozenset[str]) -> tuple[Solid, ...]:
    """Return the solids of a skeleton. Solids of equal color on a body are merged.

    Args:
        skeleton: The `Skeleton` of a robot.
        actuated: Names of the actuated joints and struts.
    """
    radius = _THIN * skeleton.size
    found = []
    for k, body in enumerate(skeleton.bodies):
        parts = [part for shape in body.shapes for part in _parts(shape, k, radius, actuated)]
        if k == skeleton.tip:
            parts += _frame(k, skeleton.tip_placement, radius)
        parts.sort(key=_look)
        for (joint, colour), alike in groupby(parts, _look):
            found.append(Solid(k, joint, colour, joined([part.triangles for part in alike])))
    return tuple(found)


def _look(solid: Solid) -> tuple[str, Colour]:
    return solid.joint, solid.colour


def _parts(shape: Any, body: int, radius: float, actuated: frozenset[str]) -> Iterator[Solid]:
    points = np.array(shape.points, dtype=np.float64)
    axis = np.array(shape.axis, dtype=np.float64) if shape.axis else None
    is_moved = shape.name in actuated and shape.kind in _SYMBOLS
    colour = BLUE if is_moved else _COLOURS.get(shape.kind, _PASSIVE)
    if body == 0 and shape.kind in ("link", "plate"):
        colour = _GROUND
    joint = shape.name if is_moved else ""
    for triangles in _surfaces(shape.kind, points, axis, radius):
        yield Solid(body, joint, colour, triangles)
    if shape.kind in ("barrel", "piston", "rod"):
        # Draw a ball at each joint: at the first end of a barrel, at the last end of a piston, and
        # at both ends of a rod.
        ends = {"barrel": points[:1], "piston": points[-1:], "rod": points}[shape.kind]
        for end in ends:
            yield Solid(body, "", _PASSIVE, ball(end, 1.7 * radius))


_SYMBOLS = frozenset({"revolute", "helical", "carriage", "ram", "piston"})
"""Kinds of drawn shapes that show an actuated joint."""
_COLOURS = {
    "link": _LINK,
    "plate": _LINK,
    "guide": _GROUND,
    "sleeve": _LINK,
    "ram": _ROD,
    "barrel": _STRUT,
    "piston": _ROD,
    "rod": _ROD,
}


def _surfaces(
    kind: str, points: FloatArray, axis: FloatArray | None, radius: float
) -> Iterator[Triangles]:
    if kind in ("link", "guide", "barrel", "piston", "rod", "ram"):
        yield from _lines(points, radius * _WIDTH[kind])
    elif kind == "plate":
        yield from _plate(points, radius)
    elif kind in ("carriage", "sleeve") and axis is not None:
        size = radius * np.array([4.5, 4.5, 6.0])
        yield from (box_on(point, axis, size) for point in points)
    elif axis is not None and kind in ("revolute", "helical", "pin"):
        half, width = (1.6, 1.9) if kind == "pin" else (3.6, 2.6)
        for point in points:
            yield tube(point - half * radius * axis, point + half * radius * axis, width * radius)
    else:
        yield from (ball(point, 2.4 * radius) for point in points)


_WIDTH = {"link": 1.0, "guide": 0.7, "barrel": 1.7, "piston": 0.9, "rod": 0.8, "ram": 1.5}
"""Radius of the drawn tube for each kind of shape, divided by the radius of a link."""


def _lines(points: FloatArray, radius: float) -> Iterator[Triangles]:
    for a, b in pairwise(points):
        if np.linalg.norm(b - a) > _SHORTEST * radius:
            yield tube(a, b, radius)
    yield from (ball(corner, radius) for corner in points[1:-1])


def _plate(points: FloatArray, radius: float) -> Iterator[Triangles]:
    """Yield a plate for coplanar points, otherwise rods from their centroid to each point."""
    center = points.mean(0)
    _, spread, axes = np.linalg.svd(points - center)
    if len(spread) < 3 or spread[2] < 1e-6 * spread[0]:  # noqa: PLR2004 - an axis has three directions
        yield plate(_around(points, center, axes), radius)
        return
    for point in points:
        yield from _lines(np.array([center, point]), radius)


def _around(points: FloatArray, center: FloatArray, axes: FloatArray) -> FloatArray:
    """Return the corners of the convex hull of coplanar points, in order."""
    flat = (points - center) @ axes[:2].T
    hull: list[int] = []
    order = np.lexsort(flat.T[::-1])
    for way in (order, order[::-1]):
        side: list[int] = []
        for k in way:
            while len(side) > 1 and _turn(flat[side[-2]], flat[side[-1]], flat[k]) <= 0:
                side.pop()
            side.append(int(k))
        hull += side[:-1]
    return points[hull]


def _turn(a: FloatArray, b: FloatArray, c: FloatArray) -> float:
    """Return twice the signed area of a planar triangle, positive if counterclockwise."""
    u, v = b - a, c - a
    return float(u[0] * v[1] - u[1] * v[0])


def _frame(body: int, T: FloatArray, radius: float) -> list[Solid]:
    """Return the tool frame: x vermilion, y green, z blue, and a gray cube at the origin."""
    origin, found = T[:3, 3], []
    for k, colour in enumerate((VERMILION, GREEN, BLUE)):
        end = origin + _FRAME * radius * T[:3, k]
        found.append(Solid(body, "", colour, tube(origin, end, 0.6 * radius)))
    cube = box(origin, T[:3, :3], np.full(3, 1.5 * radius))
    return [*found, Solid(body, "", _PASSIVE, cube)]
