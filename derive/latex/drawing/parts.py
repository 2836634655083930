"""Computes the points and directions of a robot's drawing in the base frame (meter).

All drawings share the bodies and shapes of ``chasles.derive.chain.body_shapes``.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from chasles.contract import ClosureFrames, Shape, Span

from ...chain.body_shapes import Skeleton
from ...chain.rigid_bodies import Array, tree_poses
from ...loops.model.planes import Loop


@dataclass
class Solid:
    """A group of rigidly connected bodies, which is drawn as one body.

    Attributes:
        points: Points that are connected by a line or enclosed by a convex hull.
        is_main: Whether the body belongs to the main chain.
        is_base: Whether the body contains the base.
        is_line: Whether to draw a line through the points instead of their convex hull.
    """

    points: list[Array] = field(default_factory=list)
    is_main: bool = False
    is_base: bool = False
    is_line: bool = False


@dataclass(frozen=True)
class Hinge:
    """A pin, ball joint or weld at a point.

    Attributes:
        name: Name of the joint, closure or strut.
        kind: Kind of the drawn joint, which is ``pin``, ``ball`` or ``weld``.
        at: The position of the hinge in the base frame (meter).
        axis: The axis of a pin, directed so that positive joint values are right-handed rotations.
        a: Index of the parent body.
        b: Index of the child body, or -1 for a strut.
        coordinate: Index of the coordinate in ``q`` that moves the joint.
        is_main: Whether the joint belongs to the main chain.
    """

    name: str
    kind: str
    at: Array
    axis: Array | None
    a: int
    b: int
    coordinate: int | None = None
    is_main: bool = False


@dataclass(frozen=True)
class DrawnSlide:
    """A prismatic joint, drawn as a slider on a guide or as a telescope.

    Attributes:
        name: Name of the joint or closure.
        start: The position of the slider if the coordinate is zero.
        at: The position of the slider.
        axis: The direction of the guide.
        a: Index of the body with the guide.
        b: Index of the sliding body.
        mouth: End of a telescope's outer tube.
        travel: The slider positions at both limits.
        coordinate: Index of the coordinate in ``q`` that moves the joint.
        is_main: Whether the joint belongs to the main chain.
    """

    name: str
    start: Array
    at: Array
    axis: Array
    a: int
    b: int
    mouth: Array | None = None
    travel: tuple[Array, ...] = ()
    coordinate: int | None = None
    is_main: bool = False


@dataclass(frozen=True)
class Bar:
    """A rod or a cylinder between two points."""

    name: str
    a: Array
    b: Array
    is_cylinder: bool
    coordinate: int | None = None


@dataclass(frozen=True)
class Scene:
    """All drawn parts of a robot in one configuration.

    Attributes:
        solids: The drawn groups of rigidly connected bodies, starting with the base.
        hinges: The pins, ball joints and welds of the drawing.
        slides: Sliders and telescopes.
        bars: Rods and cylinders.
        loops: The corners of each loop, in the order of the description.
        tool: The tool frame (4, 4).
        base: The base frame (4, 4), or None if the base frame is not drawn.
        foot: End points of the line from the ground to the robot's only base joint, or None if the
            drawing has no such line.
    """

    solids: Sequence[Solid]
    hinges: Sequence[Hinge]
    slides: Sequence[DrawnSlide]
    bars: Sequence[Bar]
    loops: Sequence[Sequence[Array]]
    tool: Array
    base: Array | None = None
    foot: tuple[Array, Array] | None = None

    @property
    def points(self) -> list[Array]:
        """Return all points of the picture."""
        found = [point for solid in self.solids for point in solid.points]
        found += [hinge.at for hinge in self.hinges]
        found += [p for slide in self.slides for p in (slide.start, slide.at, *slide.travel)]
        found += [point for bar in self.bars for point in (bar.a, bar.b)]
        return [*found, self.tool[:3, 3]]


@dataclass(frozen=True)
class DrawnMembers:
    """Properties of the joints, struts and loops that a drawing shows.

    Attributes:
        coordinates: Numbers (1, 2, ...) of the actuated coordinates, keyed by the name of the joint
            or cylinder that each coordinate moves.
        main: Names of the main-chain joints.
        loops: The loops.
    """

    coordinates: Mapping[str, int]
    main: Collection[str]
    loops: Sequence[Loop] = ()


def scene(skeleton: Skeleton, values: Sequence[float], members: DrawnMembers) -> Scene:
    """Return the parts to draw for a robot in one configuration.

    Args:
        skeleton: The bodies of the mechanism, with their drawn shapes.
        values: The drawn configuration (radian or meter), which is q for a serial robot and z for a
            robot with loops.
        members: Properties of the joints, struts and loops of the robot.
    """
    return _Builder(skeleton, values, members).built()


class _Builder:
    def __init__(self, skeleton: Skeleton, values: Sequence[float], members: DrawnMembers) -> None:
        self.skeleton, self.members = skeleton, members
        self.poses = tree_poses(skeleton.bodies, values)
        self.root = self._roots()
        joints = [body.joint for body in skeleton.bodies]
        self.body_of = {joint.name: k for k, joint in enumerate(joints) if joint}
        self.closures = {closure.name: closure for closure in skeleton.closures}
        self.spans = {body.span.name: body.span for body in skeleton.bodies if body.span}
        self.solids = [
            Solid(is_main=joint is None or joint.name in members.main, is_base=k == 0)
            for k, joint in enumerate(joints[: len(self.poses)])
        ]
        self.hinges: list[Hinge] = []
        self.slides: list[DrawnSlide] = []
        self.bars: list[Bar] = []

    def built(self) -> Scene:
        foot = self._foot()
        for k, shapes in enumerate(self.skeleton.shapes):
            for shape in shapes:
                self._shape(k, shape)
        for k, solid in enumerate(self.solids[: len(self.poses)]):
            if not solid.points:
                solid.points.append(self.poses[k][:3, 3])
        tool = self.poses[self.skeleton.tip] @ self.skeleton.tip_placement
        corners = [self._corners(loop) for loop in self.members.loops]
        base = None if corners else np.eye(4)
        return Scene(self.solids, self.hinges, self.slides, self.bars, corners, tool, base, foot)

    def _roots(self) -> list[int]:
        root = [0]
        for k, body in enumerate(self.skeleton.bodies[1 : len(self.poses)], 1):
            is_fixed = body.joint is not None and body.joint.kind == "fixed"
            root.append(root[body.parent] if is_fixed else k)
        return root

    def _foot(self) -> tuple[Array, Array] | None:
        lines = [shape for shape in self.skeleton.shapes[0] if shape.kind == "link"]
        ends = [end for closure in self.closures.values() for end in closure.bodies]
        ends += [end for span in self.spans.values() for end in span.bodies]
        ends += [body.parent for k, body in enumerate(self.skeleton.bodies) if k in self.root[1:]]
        if not lines or sum(end >= 0 and self.root[end] == 0 for end in ends) != 1:
            return None
        points = [self._at(0, point) for point in lines[0].points]
        self.solids.append(Solid(points, is_main=True, is_line=True))
        return points[0], points[1]

    # --- shapes ---

    def _shape(self, k: int, shape: Shape) -> None:
        if shape.kind in ("link", "plate"):
            self._solid(k, shape)
        elif shape.kind in ("rod", "barrel"):
            self._strut(self.spans[shape.name], shape)
        elif shape.name in self.closures and shape.kind != "guide":
            self._closure(k, self.closures[shape.name], shape)
        elif shape.name in self.body_of:
            self._joint(k, shape)

    def _solid(self, k: int, shape: Shape) -> None:
        if k == 0 and len(self.solids) > len(self.poses):
            return
        solid = self.solids[k]
        solid.points.extend(self._at(k, point) for point in shape.points)
        solid.is_line = shape.kind == "link" and k > 0

    def _joint(self, k: int, shape: Shape) -> None:
        first = self.body_of[shape.name]
        carrier = self._carrier(first)
        point = self._at(k, shape.points[-1])
        if shape.kind in ("ball", "universal"):
            self.hinges.append(self._hinge(shape.name, "ball", point, None, carrier, k))
        elif shape.kind in ("revolute", "helical"):
            axis = np.sign(self._ratio(k)) * self._direction(k, shape)
            self.hinges.append(self._hinge(shape.name, "pin", point, axis, carrier, k))
        elif shape.kind == "carriage":
            self._slide(k, shape, carrier, travel=tuple(self._points(shape.name, "guide")))
        elif shape.kind == "ram":
            (start,) = self._points(shape.name, "sleeve")
            self._tube(k, [start, point])
            self._slide(k, shape, carrier, mouth=start)

    def _carrier(self, k: int) -> int:
        parent = self.root[self.skeleton.bodies[k].parent]
        return len(self.poses) if parent == 0 and len(self.solids) > len(self.poses) else parent

    def _tube(self, k: int, points: list[Array]) -> None:
        solid = self.solids[k]
        if len(solid.points) > 1 and not solid.is_line:
            self.solids.append(Solid(points, is_main=solid.is_main, is_line=True))
        else:
            solid.points[:0] = points
            solid.is_line = True

    def _slide(
        self,
        k: int,
        shape: Shape,
        carrier: int,
        travel: tuple[Array, ...] = (),
        mouth: Array | None = None,
    ) -> None:
        at, axis = self._at(k, shape.points[-1]), self._direction(k, shape)
        start = travel[0] if travel else at if mouth is None else mouth
        self.slides.append(
            DrawnSlide(
                *(shape.name, start, at, axis, carrier, k, mouth, travel),
                coordinate=self.members.coordinates.get(shape.name),
                is_main=shape.name in self.members.main,
            )
        )

    def _closure(self, k: int, closure: ClosureFrames, shape: Shape) -> None:
        a, b = (self.root[body] for body in closure.bodies)
        if shape.kind == "carriage":
            self._slide(k, shape, a, travel=tuple(self._points(shape.name, "guide")))
        elif k == a:
            axis = self._direction(k, shape) if shape.axis else None
            point = self._at(k, shape.points[0])
            self.hinges.append(Hinge(shape.name, shape.kind, point, axis, a, b))

    def _strut(self, span: Span, shape: Shape) -> None:
        a, b = (self._at(body, end) for body, end in zip(span.bodies, span.ends, strict=True))
        for body, point in zip(span.bodies, (a, b), strict=True):
            self.hinges.append(Hinge(span.name, shape.ends, point, None, self.root[body], -1))
        coordinate = self.members.coordinates.get(span.name)
        self.bars.append(Bar(span.name, a, b, shape.kind == "barrel", coordinate))

    def _hinge(
        self, name: str, kind: str, point: Array, axis: Array | None, a: int, b: int
    ) -> Hinge:
        coordinate, is_main = self.members.coordinates.get(name), name in self.members.main
        return Hinge(name, kind, point, axis, a, b, coordinate, is_main)

    # --- loops ---

    def _corners(self, loop: Loop) -> list[Array]:
        there = [p for joint in loop.to_a for p in self._passed(joint.name)]
        back = [p for joint in loop.to_b for p in self._passed(joint.name)]
        return [*there, *self._ends(loop.loop_joint.name), *back[::-1]]

    def _passed(self, name: str) -> list[Array]:
        k = self.body_of[name]
        body = self.skeleton.bodies[k]
        assert body.joint is not None
        if not any(shape.name == name for shapes in self.skeleton.shapes for shape in shapes):
            return []
        fixed = self.poses[body.parent] @ body.placement
        return [fixed[:3, :3] @ body.joint.at + fixed[:3, 3], self._at(k, body.joint.at)]

    def _ends(self, name: str) -> list[Array]:
        if name in self.closures:
            closure = self.closures[name]
            frames = zip(closure.bodies, closure.frames, strict=True)
            return [self._at(k, tuple(row[3] for row in rows)) for k, rows in frames]
        span = self.spans[name]
        return [self._at(k, end) for k, end in zip(span.bodies, span.ends, strict=True)]

    # --- points ---

    def _points(self, name: str, kind: str) -> list[Array]:
        return [
            self._at(k, point)
            for k, shapes in enumerate(self.skeleton.shapes)
            for shape in shapes
            if (shape.kind, shape.name) == (kind, name)
            for point in shape.points
        ]

    def _at(self, k: int, point: Array | tuple[float, ...]) -> Array:
        T = self.poses[k]
        found: Array = T[:3, :3] @ np.array(point) + T[:3, 3]
        return found

    def _direction(self, k: int, shape: Shape) -> Array:
        found: Array = self.poses[k][:3, :3] @ np.array(shape.axis)
        return found

    def _ratio(self, k: int) -> float:
        joint = self.skeleton.bodies[k].joint
        return joint.ratio if joint else 1.0
