"""Shapes for drawing the bodies of a robot: lines, plates and joint symbols.

Rigidly connected bodies are drawn as one body. The shapes of rigidly connected bodies are expressed
in the frame of the first of these bodies.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from chasles.contract import BodyJoint, ClosureFrames, Shape, Span

from ..model.mechanism import Closure, Mechanism, Strut
from ..model.tolerances import DRAWN_AS_ONE, DRAWN_DIGITS, SAME_POINT, SAME_VIEW
from .drawn_configuration import drawn_configuration
from .rigid_bodies import Array, RigidBodies, TreeBody, Vector

Point = Array | Vector
BARREL = 0.85
"""Barrel length of a cylinder as a fraction of its retracted length."""
INSIDE = 0.15
"""Minimum rod length inside the barrel, as a fraction of the retracted cylinder length."""
WITHOUT_LENGTH = 0.55
"""Barrel length of a cylinder with a short or zero retracted length, as a fraction of the cylinder
length in the reference configuration."""
DETOUR = 1.6
"""Maximum relative length of a link that is drawn along the common normal of two joint axes.

The relative length of a link is its drawn length divided by the distance between its ends. A link
with a larger relative length is drawn as a straight line.
"""
APART = 0.08
"""Maximum shift of a symbol that overlaps another symbol, as a fraction of the robot size."""


@dataclass(frozen=True)
class Skeleton:
    """The bodies of a robot with their shapes.

    Attributes:
        bodies: All bodies of the robot: the ground, then one body per joint, then the bodies of
            struts.
        shapes: The drawn shapes of each body.
        tip: Index of the body that carries the tip frame of the robot.
        tip_placement: The tip frame in the frame of the tip body (4, 4).
        q_drawn: The configuration q in which a serial robot is drawn, or an empty tuple for a robot
            with loops.
        size: Size of the robot (meter): diagonal of the bounding box of frames, joints and tip in
            the reference configuration.
        closures: The frame pairs connected by loop-closing joints.
    """

    bodies: tuple[TreeBody, ...]
    shapes: tuple[tuple[Shape, ...], ...]
    tip: int
    tip_placement: Array
    q_drawn: tuple[float, ...]
    size: float
    closures: tuple[ClosureFrames, ...] = ()


def skeleton(rigid: RigidBodies, actuated: Sequence[str] = ()) -> Skeleton:
    """Return the bodies of a robot, with the shapes that draw each body.

    Two consecutive passive revolute joints share the symbol ``universal``, three share the symbol
    ``ball``. Consecutive passive prismatic joints have no symbol, because they stand for the free
    translation of a platform.

    Args:
        rigid: The rigid bodies of the robot.
        actuated: Names of the actuated joints and cylinders.
    """
    return _Shapes(rigid, set(actuated)).all()


def rows_of_joints(rigid: RigidBodies, actuated: set[str]) -> list[list[int]]:
    """Return groups of consecutive passive joints.

    The groups of passive joints contain no prismatic joint with limits, because such a joint is
    drawn with a guide.
    """
    rows: list[list[int]] = []
    for k, body in enumerate(rigid.bodies):
        joint = body.joint
        if joint is None or joint.kind == "fixed" or body.is_part or joint.name in actuated:
            continue
        if joint.kind == "prismatic" and None not in body.limits:
            continue
        row = next((row for row in rows if row[-1] == body.parent), None)
        if row and _is_bare(rigid, row[-1], k):
            row.append(k)
        else:
            rows.append([k])
    return [row for row in rows if len(row) > 1 and _slides(rigid, row) != 1]


def _slides(rigid: RigidBodies, row: Sequence[int]) -> int:
    joints = [rigid.bodies[k].joint for k in row]
    return sum(joint is not None and joint.kind == "prismatic" for joint in joints)


def _is_bare(rigid: RigidBodies, inner: int, outer: int) -> bool:
    carried = [k for k, body in enumerate(rigid.bodies) if body.parent == inner]
    joint, placement = rigid.bodies[inner].joint, rigid.bodies[outer].placement
    if (
        carried != [outer]
        or inner in _attached_bodies(rigid)
        or inner == rigid.tip
        or joint is None
    ):
        return False
    outer_joint = rigid.bodies[outer].joint
    assert outer_joint is not None
    point = placement[:3, :3] @ outer_joint.at + placement[:3, 3]
    return bool(np.linalg.norm(point - joint.at) < SAME_POINT)


def _attached_bodies(rigid: RigidBodies) -> set[int]:
    if not isinstance(rigid.robot, Mechanism):
        return set()
    frames = [
        frame for loop_joint in rigid.robot.loop_joints for frame in (loop_joint.a, loop_joint.b)
    ]
    return {rigid.index[frame.body] for frame in frames}


@dataclass
class _Attached:
    points: list[Array] = field(default_factory=list)
    axes: list[Array | None] = field(default_factory=list)

    def add(self, point: Array, axis: Array | None = None) -> None:
        self.points.append(point)
        self.axes.append(axis)


class _Shapes:
    def __init__(self, rigid: RigidBodies, actuated: set[str]) -> None:
        self.rigid, self.actuated = rigid, actuated
        self.bodies = list(rigid.bodies)
        self.root, self.in_root = self._groups()
        self.attached = [_Attached() for _ in self.bodies]
        self.shapes: list[list[Shape]] = [[] for _ in self.bodies]
        self.row_of = {k: row for row in rows_of_joints(rigid, actuated) for k in row}
        self.loop_joints = rigid.robot.loop_joints if isinstance(rigid.robot, Mechanism) else ()
        self.size = rigid.size
        self.digits = DRAWN_DIGITS - math.ceil(math.log10(self.size))

    def all(self) -> Skeleton:
        for k in range(1, len(self.rigid.bodies)):
            self._joint(k)
        for loop_joint in self.loop_joints:
            if isinstance(loop_joint, Closure):
                self._closure(loop_joint)
            else:
                self._strut(loop_joint)
        self._attach(self.rigid.tip, self.rigid.tip_placement[:3, 3])
        for k in range(len(self.rigid.bodies)):
            self._body(k)
        for k in range(1, len(self.rigid.bodies)):
            self._part_from_next(k)
        return Skeleton(
            tuple(self.bodies),
            tuple(map(tuple, self.shapes)),
            self.rigid.tip,
            self.rigid.tip_placement,
            drawn_configuration(self.rigid),
            self.size,
            tuple(self.rigid.closure_frames(c) for c in self.loop_joints if isinstance(c, Closure)),
        )

    def _groups(self) -> tuple[list[int], list[Array]]:
        root, frames = [0], [np.eye(4)]
        for k, body in enumerate(self.bodies[1:], 1):
            joint = body.joint
            is_fixed = joint is not None and (joint.kind == "fixed" or body.is_part)
            root.append(root[body.parent] if is_fixed else k)
            frames.append(frames[body.parent] @ body.placement if is_fixed else np.eye(4))
        return root, frames

    # --- members ---

    def _attach(self, body: int, point: Point, axis: Point | None = None) -> None:
        T = self.in_root[body]
        turned = None if axis is None else T[:3, :3] @ axis
        self.attached[self.root[body]].add(T[:3, :3] @ point + T[:3, 3], turned)

    def _put(
        self,
        body: int,
        kind: str,
        name: str,
        points: Sequence[Point],
        axis: Point | None = None,
        ends: str = "",
    ) -> None:
        T = self.in_root[body]
        moved = [T[:3, :3] @ point + T[:3, 3] for point in points]
        turned = () if axis is None else self._rounded(T[:3, :3] @ axis, DRAWN_DIGITS)
        rounded = tuple(self._rounded(point, self.digits) for point in moved)
        self.shapes[self.root[body]].append(Shape(kind, name, rounded, turned, ends))

    @staticmethod
    def _rounded(vector: Array, digits: int) -> tuple[float, ...]:
        return tuple(round(float(part), digits) + 0.0 for part in vector)

    def _joint(self, k: int) -> None:
        body = self.bodies[k]
        joint, row = body.joint, self.row_of.get(k, [k])
        if joint is None or joint.kind == "fixed" or body.is_part or row[0] != k:
            return
        if _slides(self.rigid, row) > 1:
            return
        # Consecutive passive revolute joints at the same position are drawn as one joint.
        first = body.placement
        at_parent = first[:3, :3] @ joint.at + first[:3, 3]
        axis_on_parent = first[:3, :3] @ joint.axis
        last = self.bodies[row[-1]].joint
        assert last is not None
        is_single = len(row) == 1
        self._attach(body.parent, at_parent, axis_on_parent if is_single else None)
        self._attach(row[-1], last.at, last.axis if is_single else None)
        if not is_single:
            kind = "universal" if len(row) == 2 else "ball"  # noqa: PLR2004
            self._put(row[-1], kind, joint.name, [last.at])
        elif joint.kind == "prismatic":
            self._slide(k, joint, at_parent, axis_on_parent)
        else:
            self._put(k, joint.kind, joint.name, [joint.at], joint.axis)

    def _slide(self, k: int, joint: BodyJoint, start: Array, axis: Array) -> None:
        parent = self.bodies[k].parent
        carrier = self.bodies[self.root[parent]].joint
        low, high = self._travel(k, joint)
        if carrier is None or carrier.kind == "prismatic":
            self._put(parent, "guide", joint.name, [start + low * axis, start + high * axis], axis)
            self._put(k, "carriage", joint.name, [joint.at], joint.axis)
            return
        self._put(parent, "sleeve", joint.name, [start], axis)
        self._put(
            k, "ram", joint.name, [joint.at - high * np.array(joint.axis), joint.at], joint.axis
        )

    def _travel(self, k: int, joint: BodyJoint) -> tuple[float, float]:
        low, high = self.bodies[k].limits
        if low is None or high is None:
            z = self.rigid.reference[self.rigid.names[joint.coordinate]]
            at = joint.ratio * z + joint.offset
            return at, at + 0.4 * self.size
        ends = joint.ratio * low + joint.offset, joint.ratio * high + joint.offset
        return min(ends), max(ends)

    def _closure(self, closure: Closure) -> None:
        (a, A), (b, B) = self.rigid.end(closure.a), self.rigid.end(closure.b)
        self._attach(a, A[:3, 3], A[:3, 2])
        self._attach(b, B[:3, 3], B[:3, 2])
        if closure.kind == "slider":
            half = self.size / 10
            axis = A[:3, 2]
            ends = [A[:3, 3] - half * axis, A[:3, 3] + half * axis]
            self._put(a, "guide", closure.name, ends, axis)
            self._put(b, "carriage", closure.name, [B[:3, 3]], B[:3, 2])
            return
        axis_or_none = A[:3, 2] if closure.kind == "pin" else None
        self._put(a, closure.kind, closure.name, [A[:3, 3]], axis_or_none)
        if closure.kind == "pin":
            self._put(b, closure.kind, closure.name, [B[:3, 3]], B[:3, 2])

    def _strut(self, strut: Strut) -> None:
        span = self.rigid.span(strut)
        for body, end in zip(span.bodies, span.ends, strict=True):
            self._attach(body, end)
        value = self.rigid.terms.value
        length = float(value(strut.length))
        if not strut.is_cylinder:
            self._part(span, strut, "rod", (0.0, length))
            return
        limits = [None if limit is None else float(value(limit)) for limit in strut.limits]
        here = length + self.rigid.reference[strut.name]
        shortest = length + (limits[0] if limits[0] is not None else 0.0)
        longest = length + limits[1] if limits[1] is not None else 1.5 * here
        barrel = BARREL * shortest if shortest > 0.2 * longest else WITHOUT_LENGTH * here
        piston = longest - barrel + INSIDE * max(shortest, 0.0)
        self._part(span, strut, "barrel", (0.0, barrel))
        self._part(self.rigid.span(strut, from_end=True), strut, "piston", (-piston, 0.0))

    def _part(self, span: Span, strut: Strut, kind: str, along: tuple[float, float]) -> None:
        name = strut.sections[kind == "piston"]
        k = len(self.bodies)
        self.bodies.append(TreeBody(name, -1, np.eye(4), span=span))
        self.root.append(k)
        self.in_root.append(np.eye(4))
        self.shapes.append([])
        points = [np.array([0.0, 0.0, z]) for z in along]
        self._put(k, kind, strut.name, points, ends=strut.ends)

    # --- overlapping symbols ---

    def _part_from_next(self, k: int) -> None:
        for c, body in enumerate(self.rigid.bodies):
            if body.parent != k or not (self._is_turn(k) and self._is_turn(c)):
                continue
            own, outer = self.bodies[k].joint, body.joint
            assert own is not None
            assert outer is not None
            there = body.placement[:3, :3] @ outer.at + body.placement[:3, 3]
            if np.linalg.norm(there - own.at) > DRAWN_AS_ONE * self.size:
                continue
            parent, placement = self.bodies[k].parent, self.bodies[k].placement
            back = self._along(parent, placement[:3, :3] @ own.axis, -1)
            if back and self.root[parent] == parent:
                self._shift(k, own, back)
            elif ahead := self._along(c, outer.axis, 0):
                self._shift(c, outer, ahead)
            elif not any(shape.kind in ("link", "plate") for shape in self.shapes[c]):
                self._stub(c, outer)

    def _is_turn(self, k: int) -> bool:
        return any(shape.kind == "revolute" for shape in self.shapes[k])

    def _along(self, k: int, axis: Point, end: int) -> float:
        """Return the displacement of a joint symbol along the joint axis, in meters.

        The displacement is 0 if the link drawn at the joint is not parallel to the joint axis.
        """
        lines = [shape.points for shape in self.shapes[k] if shape.kind == "link"]
        if not lines:
            return 0.0
        near, far = (lines[0][-1], lines[0][-2]) if end else lines[0][:2]
        displacement = np.array(far) - np.array(near)
        length = float(np.linalg.norm(displacement))
        if abs(abs(float(displacement @ axis)) - length) > SAME_VIEW * length:
            return 0.0
        return math.copysign(min(length / 2, APART * self.size), float(displacement @ axis))

    def _stub(self, k: int, joint: BodyJoint) -> None:
        ends = [np.array(joint.at), joint.at + APART * self.size / 2 * np.array(joint.axis)]
        points = tuple(self._rounded(point, self.digits) for point in ends)
        self.shapes[k].insert(0, Shape("link", self.bodies[k].name, points))
        self._shift(k, joint, APART * self.size / 2)

    def _shift(self, k: int, joint: BodyJoint, by: float) -> None:
        for index, shape in enumerate(self.shapes[k]):
            if shape.kind == "revolute":
                point = self._rounded(joint.at + by * np.array(joint.axis), self.digits)
                self.shapes[k][index] = replace(shape, points=(point,))

    # --- bodies ---

    def _body(self, k: int) -> None:
        if self.root[k] != k:
            return
        own = self.attached[k]
        on_slides = any(shape.kind == "guide" for shape in self.shapes[k])
        if k == 0 and len(own.points) == 1 and not on_slides:
            own.points.insert(0, np.zeros(3))
            own.axes.insert(0, own.axes[0])
        points = self._distinct(own.points)
        if len(points) < 2:  # noqa: PLR2004
            return
        kind = "plate"
        if len(points) == 2 and len(own.points) == 2:  # noqa: PLR2004
            points, kind = self._along_axes(own), "link"
        elif self._are_in_line(points):
            kind = "link"
            points = self._in_order(points)
        rounded = tuple(self._rounded(point, self.digits) for point in points)
        self.shapes[k].insert(0, Shape(kind, self.bodies[k].name, rounded))

    def _distinct(self, points: Sequence[Array]) -> list[Array]:
        found: list[Array] = []
        for point in points:
            if all(np.linalg.norm(point - other) > DRAWN_AS_ONE * self.size for other in found):
                found.append(point)
        return found

    @staticmethod
    def _are_in_line(points: Sequence[Array]) -> bool:
        offsets = np.array(points[1:]) - points[0]
        values = np.linalg.svd(offsets, compute_uv=False)
        return bool(len(values) < 2 or values[1] < SAME_VIEW * values[0])  # noqa: PLR2004

    @staticmethod
    def _in_order(points: Sequence[Array]) -> list[Array]:
        offsets = np.array(points) - points[0]
        along = offsets[int(np.argmax(np.linalg.norm(offsets, axis=1)))]
        return [points[k] for k in np.argsort(np.round(offsets @ along, 12), kind="stable")]

    def _along_axes(self, own: _Attached) -> list[Array]:
        (p, q), (u, v) = own.points, own.axes
        feet = [p, q]
        if u is not None and v is not None:
            feet = _feet(p, u, q, v)
        elif u is not None:
            feet = [p + u * (u @ (q - p)), q]
        displacement = [p, *self._distinct([p, q, *feet])[2:], q]
        length = sum(float(np.linalg.norm(b - a)) for a, b in pairwise(displacement))
        return displacement if length <= DETOUR * float(np.linalg.norm(q - p)) else [p, q]


def _feet(p: Array, u: Array, q: Array, v: Array) -> list[Array]:
    """Return the end points of the common normal of two lines.

    Line 1 passes through the point p with direction u, and line 2 through the point q with
    direction v.
    """
    c = float(u @ v)
    s2 = 1 - c * c
    if s2 < SAME_VIEW:
        return [p + u * (u @ (q - p)), q]
    d = q - p
    a, b = (d @ u - c * (d @ v)) / s2, (c * (d @ u) - d @ v) / s2
    return [p + a * u, q + b * v]
