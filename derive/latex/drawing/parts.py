"""The parts of a mechanism's drawing, as points and directions in the base frame (metre)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ...chain.body_shapes import rows_of_joints
from ...chain.rigid_bodies import RigidBodies
from ...loops.planar.planes import Loop, loops
from ...model.errors import RobotError
from ...model.mechanism import Closure, Mechanism, Strut
from ...model.robot import Joint
from ...model.tolerances import VISIBLE_GAP
from .poses import Array, Poses

LONG = 0.05
"""A slide longer than this part of the robot's size is drawn as a telescope."""
MOUTH = 0.6
"""The part of a telescope's length at which its outer tube ends."""


@dataclass
class Solid:
    """Bodies that are fixed to each other.

    Attributes:
        points: The points of joints and struts on them.
        is_main: Whether the main chain passes through them.
        is_base: Whether the base is one of them.
        is_line: Whether they are drawn as a line through the points in order, not as their hull.
    """

    points: list[Array] = field(default_factory=list)
    is_main: bool = False
    is_base: bool = False
    is_line: bool = False


@dataclass(frozen=True)
class Hinge:
    """A pin, ball or weld at a point.

    Attributes:
        name: Name of the joint, closure or strut.
        kind: ``pin``, ``ball`` or ``weld``.
        at: The point.
        axis: The direction of a pin, as the coordinate counts.
        a: Index of the solid that carries it.
        b: Index of the solid that it carries, -1 for a strut.
        coordinate: Index of the entry of ``q`` that moves it.
        is_main: Whether it is a joint of the main chain.
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
    """A slider on its guide, or a telescope.

    Attributes:
        name: Name of the joint or closure.
        start: The point of the guide at which the coordinate is zero.
        at: The position of the slider.
        axis: The direction of the guide.
        a: Index of the solid with the guide.
        b: Index of the solid that slides.
        mouth: The end of a telescope's outer tube.
        travel: The positions of a slider at its limits.
        coordinate: Index of the entry of ``q`` that moves it.
        is_main: Whether it is a joint of the main chain.
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
    """A rod or a cylinder."""

    name: str
    a: Array
    b: Array
    is_cylinder: bool
    coordinate: int | None = None


@dataclass(frozen=True)
class Scene:
    """All parts of a mechanism at one configuration.

    Attributes:
        solids: Bodies, the base first; bodies that are fixed to each other are one.
        hinges: Pins, balls and welds.
        slides: Sliders and telescopes.
        bars: Rods and cylinders.
        loops: The corners of each loop, in the order of the description.
        tool: The tool frame (4, 4).
        base: The base frame (4, 4); None where it is not drawn.
    """

    solids: Sequence[Solid]
    hinges: Sequence[Hinge]
    slides: Sequence[DrawnSlide]
    bars: Sequence[Bar]
    loops: Sequence[Sequence[Array]]
    tool: Array
    base: Array | None = None

    @property
    def points(self) -> list[Array]:
        """All points that must be on the picture."""
        found = [point for solid in self.solids for point in solid.points]
        found += [hinge.at for hinge in self.hinges]
        found += [p for slide in self.slides for p in (slide.start, slide.at, *slide.travel)]
        found += [point for bar in self.bars for point in (bar.a, bar.b)]
        return [*found, self.tool[:3, 3]]


def scene(mechanism: Mechanism, poses: Poses, configuration: Mapping[str, float]) -> Scene:
    """The parts of a mechanism at a configuration.

    Sliders and hinges without a body between them are drawn as one joint: passive hinges in one
    point as a ball. Passive sliders in a row are not drawn, for they are only the coordinates of a
    platform.

    Args:
        mechanism: The description.
        poses: The poses of its bodies.
        configuration: Values of joints and cylinders (radian or metre).

    Raises:
        RobotError: A cylinder has no value, or a loop stands open.
    """
    return _Builder(mechanism, poses, configuration).built()


class _Builder:
    """The parts, one member of the description at a time."""

    def __init__(
        self, mechanism: Mechanism, poses: Poses, configuration: Mapping[str, float]
    ) -> None:
        self.mechanism, self.poses, self.configuration = mechanism, poses, configuration
        self.moved_by = {c.moves: k for k, c in enumerate(mechanism.coordinates, 1)}
        self.main = {joint.name for joint in mechanism.main_chain.joints}
        self.solids, self.solid_of = self._solids()
        self.hinges: list[Hinge] = []
        self.slides: list[DrawnSlide] = []
        self.bars: list[Bar] = []
        self.merged: dict[str, list[Joint]] = {}
        for run in self._runs():
            self.merged.update((joint.name, run) for joint in run)
        self.tool = poses.body[mechanism.tool_body] @ poses.matrix(mechanism.tool)
        self.size = self._size()

    def built(self) -> Scene:
        for joint in self.mechanism.joints:
            run = self.merged.get(joint.name, [joint])
            if run[0] is joint:
                self._joint(run)
        for closure in self.mechanism.closures:
            self._closure(closure)
        for strut in self.mechanism.struts:
            self._strut(strut)
        self._attach(self.mechanism.tool_body, self.tool[:3, 3])
        corners = [self._corners(loop) for loop in loops(self.mechanism)]
        return Scene(self.solids, self.hinges, self.slides, self.bars, corners, self.tool)

    def _solids(self) -> tuple[list[Solid], dict[str, int]]:
        solids = [Solid(is_main=True, is_base=True)]
        solid_of = {self.mechanism.base_frame: 0}
        for joint in self.mechanism.joints:
            if joint.kind == "fixed":
                solid_of[joint.link] = solid_of[joint.parent]
            else:
                solid_of[joint.link] = len(solids)
                solids.append(Solid())
            solids[solid_of[joint.link]].is_main |= joint.name in self.main
        return solids, solid_of

    def _size(self) -> float:
        """The diagonal of the box around the frames of all bodies and closers."""
        bodies = [*self.poses.body.values(), *self.poses.fixed.values(), self.tool]
        ends = [frame for closer in self.mechanism.closers for frame in (closer.a, closer.b)]
        origins = np.array([T[:3, 3] for T in [*bodies, *map(self.poses.of, ends)]])
        return float(np.linalg.norm(np.ptp(origins, axis=0)))

    def _runs(self) -> list[list[Joint]]:
        """Passive joints one after the other, without a body of any size between them."""
        rigid = RigidBodies(self.mechanism, self.poses.terms, self.configuration)
        rows = rows_of_joints(rigid, set(self.moved_by))
        return [[self.mechanism.joints[k - 1] for k in row] for row in rows]

    def _attach(self, body: str, point: Array) -> int:
        """Notes a point of a body, and gives the body's solid."""
        k = self.solid_of[body]
        self.solids[k].points.append(point)
        return k

    def _joint(self, run: Sequence[Joint]) -> None:
        joint, last = run[0], run[-1]
        if joint.kind == "fixed" or sum(j.kind == "prismatic" for j in run) > 1:
            return
        fixed, moved = self.poses.fixed[joint.name], self.poses.moved[joint.name]
        a, b = self._attach(joint.parent, fixed[:3, 3]), self._attach(last.link, moved[:3, 3])
        axis = joint.direction * fixed[:3, 2]
        coordinate, is_main = self.moved_by.get(joint.name), joint.name in self.main
        if joint.kind == "prismatic":
            slide = DrawnSlide(joint.name, fixed[:3, 3], moved[:3, 3], axis, a, b)
            slide = replace(slide, coordinate=coordinate, is_main=is_main)
            self.slides.append(self._guided(joint, slide))
        else:
            kind = "pin" if len(run) == 1 else "ball"
            self.hinges.append(
                Hinge(joint.name, kind, moved[:3, 3], axis, a, b, coordinate, is_main)
            )

    def _guided(self, joint: Joint, slide: DrawnSlide) -> DrawnSlide:
        """A slide of an arm that turns as two tubes; any other on a guide as long as its travel."""
        carrier = self.mechanism.joint_of.get(joint.parent)
        way = slide.at - slide.start
        if carrier is None or carrier.kind != "revolute" or np.linalg.norm(way) < LONG * self.size:
            return replace(slide, travel=self._travel(joint, slide))
        mouth = slide.start + MOUTH * way
        self.solids[slide.a].points.append(mouth)
        self.solids[slide.b].points.append(mouth)
        return replace(slide, mouth=mouth)

    def _travel(self, joint: Joint, slide: DrawnSlide) -> tuple[Array, ...]:
        if None in joint.limits:
            return ()
        values = [float(self.poses.terms.value(limit)) for limit in joint.limits]
        return tuple(slide.start + value * slide.axis for value in values)

    def _closure(self, closure: Closure) -> None:
        A, B = self.poses.of(closure.a), self.poses.of(closure.b)
        gap, axis = B[:3, 3] - A[:3, 3], A[:3, 2]
        if closure.kind == "slider":
            gap = gap - axis * (axis @ gap)
        self._check_closed(closure.name, float(np.linalg.norm(gap)))
        a = self._attach(closure.a.body, A[:3, 3])
        b = self._attach(closure.b.body, B[:3, 3])
        if closure.kind == "slider":
            self.slides.append(DrawnSlide(closure.name, A[:3, 3], B[:3, 3], axis, a, b))
        else:
            self.hinges.append(Hinge(closure.name, closure.kind, A[:3, 3], axis, a, b))

    def _strut(self, strut: Strut) -> None:
        ends = [self.poses.of(frame)[:3, 3] for frame in (strut.a, strut.b)]
        length = float(self.poses.terms.value(strut.length))
        if strut.is_cylinder:
            length += self._value(strut.name)
        self._check_closed(strut.name, abs(float(np.linalg.norm(ends[1] - ends[0])) - length))
        for frame, end in zip((strut.a, strut.b), ends, strict=True):
            solid = self._attach(frame.body, end)
            self.hinges.append(Hinge(strut.name, strut.ends, end, None, solid, -1))
        coordinate = self.moved_by.get(strut.name)
        self.bars.append(Bar(strut.name, ends[0], ends[1], strut.is_cylinder, coordinate))

    def _value(self, name: str) -> float:
        if name not in self.configuration:
            raise RobotError(
                f"robot {self.mechanism.name!r}: cylinder {name!r} has no value in the "
                "configuration"
            )
        return self.configuration[name]

    def _check_closed(self, name: str, gap: float) -> None:
        if not gap <= VISIBLE_GAP * self.size:
            raise RobotError(
                f"robot {self.mechanism.name!r}: {name!r} stands open by {gap:.3g} m in the "
                "configuration; a drawing needs one that closes all loops"
            )

    def _corners(self, loop: Loop) -> list[Array]:
        """The points that a loop goes through, once around."""
        there = [p for joint in loop.to_a for p in self._passed(joint)]
        back = [p for joint in loop.to_b for p in self._passed(joint)]
        ends = [self.poses.of(frame)[:3, 3] for frame in (loop.closer.a, loop.closer.b)]
        return [*there, *ends, *back[::-1]]

    def _passed(self, joint: Joint) -> list[Array]:
        run = self.merged.get(joint.name, [])
        if joint.kind == "fixed" or sum(j.kind == "prismatic" for j in run) > 1:
            return []
        return [self.poses.fixed[joint.name][:3, 3], self.poses.moved[joint.name][:3, 3]]
