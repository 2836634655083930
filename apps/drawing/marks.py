"""Lines and areas of a drawing, the farthest first."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .skeleton import Body, Shape, Skeleton
from .views import View

FloatArray = NDArray[np.float64]

RADIUS, HALF = 1.0, 1.7
"""Radius and half the length of a revolute joint's cylinder, in drawing units."""
SMALL = 0.6
"""Radius of the symbols of loop-closing joints and strut ends, in drawing units."""
BOX = 1.25
"""Half the edge of a prismatic joint's box, in drawing units."""
_CORNERS = 32
_STROKES = 6
_HALF_GROUND = 2.6
"""Half the length of the hatched ground line under a joint, in drawing units."""
_LATER = 1e-6
"""Depth offset [drawing units] that draws a detail of a symbol on top of the symbol."""
_EDGE_ON = 0.25
"""Minimum length of a projected unit vector. A unit vector whose projection is shorter than this
value is drawn as if it points along the line of sight."""
_SYMBOLS = ("revolute", "helical", "pin", "weld", "ball", "universal", "carriage", "sleeve")
_LEVELS = {"hatch": -3, "ground": -3, "guide": -2, "plate": -1, "link": 0, "rod": 1, "ram": 0}
_SYMBOL = 4
"""Minimum drawing level of joint symbols, above all lines and plates."""
_ABOVE = 1e6
"""Depth offset that draws symbols on top of lines, in drawing units."""


@dataclass(frozen=True)
class Mark:
    """A line or an area in a drawing.

    Attributes:
        style: The drawing style, such as "link", "plate", "joint" or "driven".
        points: (k, 2) points of the line or outline [m].
        depth: Drawing order. A line or area with a larger depth is drawn later.
        name: Name of the body, joint or strut.
        is_area: Whether the area is filled.
    """

    style: str
    points: FloatArray
    depth: float
    name: str
    is_area: bool = False


@dataclass(frozen=True)
class Anchor:
    """A labeled point.

    Attributes:
        name: Name of the joint or strut.
        point: (2,) the point in the drawing [m].
        coordinate: Index in q of the coordinate that moves the joint or strut.
    """

    name: str
    point: FloatArray
    coordinate: int


def marks(skeleton: Skeleton, poses: FloatArray, view: View, unit: float) -> list[Mark]:
    """Return the lines and areas of a robot in a view, in drawing order.

    Args:
        skeleton: The bodies.
        poses: (bodies, 4, 4) poses of the bodies in the base frame.
        view: The projection.
        unit: Radius of a joint symbol [m].
    """
    return sorted(_Marks(skeleton, poses, view, unit).all(), key=lambda mark: mark.depth)


def anchors(skeleton: Skeleton, poses: FloatArray, view: View) -> list[Anchor]:
    """Return the label points of the actuated coordinates, in the order of q."""
    found = {}
    sleeves = {
        shape.name: _moved(T, np.array(shape.points[0]))
        for body, T in zip(skeleton.bodies, poses, strict=True)
        for shape in body.shapes
        if shape.kind == "sleeve"
    }
    index = {v.name: k for k, v in enumerate(skeleton.robot.configuration_variables)}
    for body, T in zip(skeleton.bodies, poses, strict=True):
        k = skeleton.actuator(body.joint)
        if body.span:
            k = skeleton.actuators.get(index.get(body.span.name, -1))
        if k is None or k in found:
            continue
        found[k] = Anchor(_name(body), view.project(_named_point(body, T, sleeves)), k)
    return [found[k] for k in sorted(found)]


def _name(body: Body) -> str:
    return body.joint.name if body.joint else body.span.name if body.span else body.name


def _named_point(body: Body, T: FloatArray, sleeves: dict[str, FloatArray]) -> FloatArray:
    if body.span:
        ends = np.array([shape.points for shape in body.shapes[:1]])[0]
        return _moved(T, ends.mean(0))
    joint = body.joint
    assert joint is not None
    if joint.name in sleeves:
        return sleeves[joint.name]
    own = [s.points[-1] for s in body.shapes if s.name == joint.name and s.kind != "link"]
    return _moved(T, np.array(own[0] if own else joint.at))


def _moved(T: FloatArray, points: FloatArray) -> FloatArray:
    found: FloatArray = points @ T[:3, :3].T + T[:3, 3]
    return found


class _Marks:
    """Yields the lines and areas of all shapes."""

    def __init__(self, skeleton: Skeleton, poses: FloatArray, view: View, unit: float) -> None:
        self.skeleton, self.poses, self.view, self.unit = skeleton, poses, view, unit
        self.is_planar = view.name == "plane"
        names = [v.name for v in skeleton.robot.configuration_variables]
        self.driven = {names[k] for k in skeleton.actuators} if names else set()
        self.ends, self.carriages = self._points_of("ram"), self._points_of("carriage")
        self.mouths = self._points_of("barrel")

    def all(self) -> Iterator[Mark]:
        yield from self._ground()
        for body, T in zip(self.skeleton.bodies, self.poses, strict=True):
            for shape in body.shapes:
                points = _moved(T, np.array(shape.points))
                axis = T[:3, :3] @ np.array(shape.axis) if shape.axis else None
                yield from self._shape(body, shape, points, axis)

    def _points_of(self, kind: str) -> dict[str, FloatArray]:
        return {
            shape.name: _moved(T, np.array(shape.points[-1]))
            for body, T in zip(self.skeleton.bodies, self.poses, strict=True)
            for shape in body.shapes
            if shape.kind == kind
        }

    def _depth(self, points: FloatArray, level: int) -> float:
        """Return the drawing order."""
        if self.is_planar:
            return float(level)
        above = _ABOVE if level >= _SYMBOL else 0.3 * level
        return self.view.depth(points) + self.unit * above

    def _behind(self, points: FloatArray) -> float:
        """Return the depth of a plate's farthest point.

        A plate that is drawn at this depth lies behind the lines.
        """
        return min(self._depth(point[None], _LEVELS["plate"]) for point in points)

    def _style(self, body: Body, shape: Shape) -> str:
        """Return the drawing style of a joint symbol."""
        joint = body.joint
        is_own = joint is not None and joint.name == shape.name
        is_driven = is_own and self.skeleton.actuator(joint) is not None
        return "driven" if is_driven or shape.name in self.driven else "joint"

    def _shape(
        self, body: Body, shape: Shape, points: FloatArray, axis: FloatArray | None
    ) -> Iterator[Mark]:
        kind = shape.kind
        is_ground = body.joint is None and body.span is None
        if kind in ("link", "guide"):
            is_base = is_ground and self.is_planar and kind == "link"
            yield self._line("base" if is_base else kind, self._long(shape, points), shape.name)
            if is_ground and kind == "guide":
                yield from self._hatched_guide(points)
        elif kind == "plate" and is_ground:
            yield from self._floor(points)
        elif kind == "plate":
            seen = hull(self.view.project(points))
            yield Mark("plate", seen, self._behind(points), shape.name, is_area=True)
        elif kind == "rod":
            yield self._line(kind, points, shape.name, 1)
            yield from self._strut_ends(shape, points)
        elif kind == "piston":
            mouth = self.mouths.get(shape.name, points[0])
            yield self._line(kind, np.array([mouth, points[1]]), shape.name, 1)
            yield from self._strut_ends(shape, points[1:])
        elif kind == "barrel":
            yield from self._barrel(shape, points)
        elif kind == "sleeve" and axis is not None:
            end = self.ends.get(shape.name, points[0])
            yield self._line("ram", np.array([points[0], end]), shape.name)
            yield from self._box(self._slide_style(shape), shape, points[0], axis)
        elif kind == "carriage" and axis is not None:
            yield from self._box(self._slide_style(shape), shape, points[0], axis)
        elif kind in _SYMBOLS:
            yield from self._joint(self._style(body, shape), shape, points[0], axis)

    def _long(self, shape: Shape, points: FloatArray) -> FloatArray:
        """Extend the guide line of a prismatic joint so that the line reaches the carriage."""
        at = self.carriages.get(shape.name) if shape.kind == "guide" else None
        if at is None:
            return points
        vector = points[1] - points[0]
        part = float((at - points[0]) @ vector / (vector @ vector))
        reached = np.array([[min(part, 0.0)], [max(part, 1.0)]])
        return np.asarray(points[0] + reached * vector)

    def _slide_style(self, shape: Shape) -> str:
        for body in self.skeleton.bodies:
            if body.joint and body.joint.name == shape.name:
                return "driven" if self.skeleton.actuator(body.joint) is not None else "joint"
        return "joint"

    def _line(self, style: str, points: FloatArray, name: str, level: int = 0) -> Mark:
        level = _LEVELS.get(style, level)
        return Mark(style, self.view.project(points), self._depth(points, level), name)

    def _joint(
        self, style: str, shape: Shape, at: FloatArray, axis: FloatArray | None
    ) -> Iterator[Mark]:
        size = self.unit * (1.0 if style == "driven" else SMALL)
        if axis is None:
            ball = self.view.project(at) + size * circle()
            depth = self._depth(at[None], _SYMBOL)
            yield Mark(style, ball, depth, shape.name, is_area=True)
            inner = {"universal": 0.3, "ball": 0.5}.get(shape.kind, 0.9)
            dot = self.view.project(at) + inner * size * circle()
            yield Mark("dot", dot, depth + self.unit * _LATER, shape.name, is_area=True)
            return
        yield from self._cylinder(style, shape.name, at, axis, size)

    def _cylinder(
        self, style: str, name: str, at: FloatArray, axis: FloatArray, size: float
    ) -> Iterator[Mark]:
        """Yield the outline and the visible end face of a cylinder around an axis."""
        across, up = _normals(axis)
        ring = RADIUS * size * (circle()[:, :1] * across + circle()[:, 1:] * up)
        half = HALF * size * axis
        ends = [at + half + ring, at - half + ring]
        outline = hull(self.view.project(np.concatenate(ends)))
        depth = self._depth(at[None], _SYMBOL)
        near = ends[0] if self.view.depth(ends[0]) >= self.view.depth(ends[1]) else ends[1]
        towards = abs(float(self.view.rows[2] @ axis))
        if self.view.name == "axonometric":
            line = np.array([at - 2.6 * size * axis, at + 2.6 * size * axis])
            yield Mark("axis", self.view.project(line), depth - self.unit * _LATER, name)
        yield Mark(style, outline, depth, name, is_area=True)
        if 0.1 < towards < 1 - 1e-9:  # noqa: PLR2004 - a face seen from its edge is a line
            yield Mark(
                style, self.view.project(near), depth + self.unit * _LATER, name, is_area=True
            )
        elif towards >= 1 - 1e-9:
            dot = self.view.project(at) + 0.25 * size * circle()
            yield Mark("dot", dot, depth + self.unit * _LATER, name, is_area=True)

    def _box(self, style: str, shape: Shape, at: FloatArray, axis: FloatArray) -> Iterator[Mark]:
        """Yield the outline and the visible faces of a prismatic joint's box."""
        across, up = _normals(axis)
        frame = BOX * self.unit * np.array([1.3 * axis, across, up])
        signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
        depth = self._depth(at[None], _SYMBOL)
        corners = at + signs @ frame
        outline = hull(self.view.project(corners))
        yield Mark(style, outline, depth, shape.name, is_area=True)
        for k in range(3):
            towards = float(self.view.rows[2] @ frame[k]) / (BOX * self.unit)
            if abs(towards) < 0.1:  # noqa: PLR2004 - a face seen from its edge is a line
                continue
            side = np.sign(towards) * frame[k]
            u, v = frame[(k + 1) % 3], frame[(k + 2) % 3]
            face = at + side + np.array([u + v, u - v, -u - v, v - u])
            yield Mark(
                style, self.view.project(face), depth + self.unit * _LATER, shape.name, is_area=True
            )

    def _barrel(self, shape: Shape, points: FloatArray) -> Iterator[Mark]:
        seen = self.view.project(points)
        vector = seen[1] - seen[0]
        length = float(np.linalg.norm(vector))
        style = "driven barrel" if shape.name in self.driven else "barrel"
        depth = self._depth(points, 2)
        if length > _EDGE_ON * self.unit:
            side = SMALL * self.unit * np.array([-vector[1], vector[0]]) / length
            corners = np.array([seen[0] + side, seen[1] + side, seen[1] - side, seen[0] - side])
            yield Mark(style, corners, depth, shape.name, is_area=True)
        yield from self._strut_ends(shape, points[:1])

    def _strut_ends(self, shape: Shape, points: FloatArray) -> Iterator[Mark]:
        for point in points:
            disc = self.view.project(point) + SMALL * self.unit * circle()
            depth = self._depth(point[None], 3)
            yield Mark("joint", disc, depth, shape.name, is_area=True)
            if shape.ends == "ball":
                dot = self.view.project(point) + 0.5 * SMALL * self.unit * circle()
                yield Mark("dot", dot, depth + self.unit * _LATER, shape.name, is_area=True)

    # --- ground ---

    def _ground(self) -> Iterator[Mark]:
        """Yield a hatched line under each joint or link of the ground."""
        shapes = self.skeleton.bodies[0].shapes
        lines = [np.array(s.points) for s in shapes if s.kind == "link"]
        if lines and not self.is_planar:
            vector = lines[0][1] - lines[0][0]
            yield from self._hatched(lines[0][0], -vector / np.linalg.norm(vector), 0.0)
            return
        if not self.is_planar and any(s.kind in ("plate", "guide") for s in shapes):
            return
        for point, axis in self._feet():
            if self.is_planar:
                yield from self._stand(point)
            else:
                yield from self._hatched(point, -axis, HALF)

    def _feet(self) -> list[tuple[FloatArray, FloatArray]]:
        """Return (points of joints on the ground, joint axes)."""
        found: list[tuple[FloatArray, FloatArray]] = []
        for body, T in zip(self.skeleton.bodies, self.poses, strict=True):
            joint = body.joint
            if joint and body.parent == 0 and joint.kind in ("revolute", "helical"):
                own = [s.points[0] for s in body.shapes if s.name == joint.name]
                at = _moved(T, np.array(own[0] if own else joint.at))
                found.append((at, T[:3, :3] @ np.array(joint.axis)))
            if body.span:
                for k, end in zip(body.span.bodies, body.span.ends, strict=True):
                    if k == 0:
                        found.append((np.array(end), np.array([0.0, 0.0, 1.0])))
        for shape in self.skeleton.bodies[0].shapes:
            if shape.kind == "pin":
                found.append((np.array(shape.points[0]), np.array(shape.axis)))
        return _distinct(found)

    def _stand(self, point: FloatArray) -> Iterator[Mark]:
        up = np.array(self.view.up)
        right = np.array(self.view.right)
        foot = point - 2.6 * self.unit * up
        legs = np.array([point, foot - 1.4 * self.unit * right, foot + 1.4 * self.unit * right])
        yield Mark("stand", self.view.project(legs), -2.0, "ground", is_area=True)
        yield from self._hatched(foot, -up, 0.0)

    def _hatched_guide(self, points: FloatArray) -> Iterator[Mark]:
        """Yield hatching strokes along and below a guide on the ground."""
        seen = self.view.project(points)
        vector = seen[1] - seen[0]
        length = float(np.linalg.norm(vector))
        if length < self.unit:
            return
        along = vector / length * (1.0 if vector[0] >= 0 else -1.0)
        begin = seen[0] if vector[0] >= 0 else seen[1]
        yield from self._strokes(begin, along, length, self._depth(points, -3))

    def _strokes(
        self, begin: FloatArray, along: FloatArray, length: float, depth: float
    ) -> Iterator[Mark]:
        """Yield hatching strokes on the right side of a directed line."""
        step = 2 * _HALF_GROUND * self.unit / _STROKES
        stroke = step * (0.9 * np.array([along[1], -along[0]]) - 0.7 * along)
        for k in range(int(length / step + 0.5)):
            start = begin + (k + 0.75) * step * along
            yield Mark("hatch", np.array([start, start + stroke]), depth, "ground")

    def _floor(self, points: FloatArray) -> Iterator[Mark]:
        """Yield the ground plate, or triangles under the joints in a planar view."""
        if not self.is_planar:
            seen = hull(self.view.project(points))
            yield Mark("floor", seen, self._depth(points, -3), "ground", is_area=True)

    def _hatched(self, point: FloatArray, away: FloatArray, by: float) -> Iterator[Mark]:
        """Yield a hatched ground line perpendicular to a direction, if the line is visible."""
        towards = self.view.rows[:2] @ away
        length = float(np.linalg.norm(towards))
        if length < _EDGE_ON:
            return
        down = towards / length
        along = np.array([-down[1], down[0]])
        at = self.view.project(point) + by * self.unit * towards
        half = _HALF_GROUND * self.unit
        depth = self._depth(point[None], _LEVELS["ground"])
        yield Mark("ground", np.array([at - half * along, at + half * along]), depth, "ground")
        yield from self._strokes(at - half * along, along, 2 * half, depth)


def _distinct(feet: Sequence[tuple[FloatArray, FloatArray]]) -> list[tuple[FloatArray, FloatArray]]:
    found: list[tuple[FloatArray, FloatArray]] = []
    for point, axis in feet:
        if all(not np.allclose(point, other) for other, _ in found):
            found.append((point, axis))
    return found


def _normals(axis: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return two directions perpendicular to an axis and to each other."""
    across = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    across /= np.linalg.norm(across)
    return across, np.cross(axis, across)


def circle() -> FloatArray:
    """Return points (k, 2) of the unit circle."""
    angle = np.linspace(0, 2 * np.pi, _CORNERS, endpoint=False)
    return np.column_stack([np.cos(angle), np.sin(angle)])


def hull(points: FloatArray) -> FloatArray:
    """Return the corners (k, 2) of the convex hull of points (m, 2), counterclockwise."""
    ordered = sorted({(float(x), float(y)) for x, y in points})
    if len(ordered) < 3:  # noqa: PLR2004 - the hull of one or two points is the points
        return np.array(ordered)
    lower, upper = _half(ordered), _half(ordered[::-1])
    return np.array(lower[:-1] + upper[:-1])


def _half(ordered: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    corners: list[tuple[float, float]] = []
    for x, y in ordered:
        while len(corners) > 1:
            (ax, ay), (bx, by) = corners[-2:]
            if (bx - ax) * (y - ay) - (by - ay) * (x - ax) > 0:
                break
            corners.pop()
        corners.append((x, y))
    return corners
