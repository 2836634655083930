"""Finds the planar loops of a mechanism.

A loop is planar if its revolute axes are parallel and its sliders are perpendicular to the revolute
axes. Loops that share a joint form one *linkage*. Each body of a linkage has its own planar axes.
The planar x axis of a body is the first axis of the body frame (x, y, z) that lies in the plane.
The planar y axis points to the left of the planar x axis. The plane normal is the first revolute
axis of the linkage. In a linkage without revolute axes, the plane normal is perpendicular to the
slider directions.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from ...chain.poe import placement_matrix
from ...model.mechanism import Closure, Frame, Mechanism, Strut
from ...model.robot import Joint, Placement, joints_to_root
from ...model.tolerances import ZERO_COMPONENT
from ...terms.terms import Terms
from .phasors import ONE, REAL, ZERO, Complex

Vector = NDArray[np.float64]

MECHANISMS = 64
"""Maximum number of mechanisms whose linkages are cached."""


@dataclass(frozen=True)
class PinEdge:
    """Two bodies of a linkage that rotate relative to each other about a common point.

    Attributes:
        name: Name of the joint, swing angle or closure.
        a: The first body, relative to which body b rotates.
        at_a: Coordinates of the common point of the bodies a and b, in the axes of body a.
        b: The other body.
        at_b: Coordinates of the common point of the bodies a and b, in the axes of body b.
        rotor: The orientation of body b in the axes of body a at joint value zero, as a unit
            complex number.
        sense: 1 if the joint axis has the direction of the plane normal, otherwise -1.
    """

    name: str
    a: str
    at_a: Complex
    b: str
    at_b: Complex
    rotor: Complex = REAL
    sense: int = 1


@dataclass(frozen=True)
class SlideEdge:
    """Two bodies of a linkage that slide along each other.

    Attributes:
        name: Name of the joint, cylinder or closure.
        a: The body with the guide along which body b slides.
        at_a: A point of the guide in the axes of body a.
        direction: The unit direction of the guide in the frame of body a.
        b: The other body.
        at_b: The point of body b that lies on the guide, at ``at_a + value * direction`` in the
            frame of body a.
        rotor: The orientation of body b in the axes of body a.
    """

    name: str
    a: str
    at_a: Complex
    direction: Complex
    b: str
    at_b: Complex
    rotor: Complex = REAL


@dataclass(frozen=True)
class WeldEdge:
    """Two bodies of a linkage that are fixed to each other.

    ``rotor`` and ``at_a`` are the orientation and origin of body b in the axes of body a.
    """

    name: str
    a: str
    at_a: Complex
    b: str
    rotor: Complex = REAL


Edge = PinEdge | SlideEdge | WeldEdge


@dataclass(frozen=True)
class Linkage:
    """The bodies and joints of planar loops that share joints.

    Attributes:
        root: The root body of the linkage, to which the plane is fixed.
        bodies: All bodies of the linkage. Barrel and rod of a cylinder are two bodies.
        edges: All joints, closures and struts of the linkage, as edges between two bodies.
        joints: Names of the moving tree joints and of the cylinders.
        loop_joints: Names of the closures and struts.
        axes: The axes x and y and the normal of the plane, in the frame of each body.
    """

    root: str
    bodies: tuple[str, ...]
    edges: tuple[Edge, ...]
    joints: tuple[str, ...]
    loop_joints: tuple[str, ...]
    axes: Mapping[str, "Axes"]


class Axes(NamedTuple):
    """The axes and the normal of a plane in the frame of a body."""

    x: sp.Matrix
    y: sp.Matrix
    n: sp.Matrix


class Loop(NamedTuple):
    """A kinematic loop: a closure or strut, and the joints of the two branches that it connects."""

    loop_joint: Closure | Strut
    meeting: str
    to_a: tuple[Joint, ...]
    to_b: tuple[Joint, ...]

    @property
    def joints(self) -> tuple[Joint, ...]:
        """All moving joints of the loop."""
        return tuple(joint for joint in (*self.to_a, *self.to_b) if joint.kind != "fixed")


def loops(mechanism: Mechanism) -> list[Loop]:
    """Return the loop of each closure and strut, in the order of the description."""
    return [_loop(mechanism, loop_joint) for loop_joint in mechanism.loop_joints]


def _loop(mechanism: Mechanism, loop_joint: Closure | Strut) -> Loop:
    a, b = mechanism.path_to(loop_joint.a.body), mechanism.path_to(loop_joint.b.body)
    shared = 0
    while shared < min(len(a), len(b)) and a[shared] is b[shared]:
        shared += 1
    meeting = a[shared - 1].link if shared else mechanism.base_frame
    return Loop(loop_joint, meeting, tuple(a[shared:]), tuple(b[shared:]))


def planar_loop_joints(mechanism: Mechanism) -> dict[str, Linkage]:
    """Return the linkage of each planar loop, keyed by the name of its closure or strut."""
    return {name: linkage for linkage in _linkages(mechanism)[0] for name in linkage.loop_joints}


def linkages(mechanism: Mechanism) -> tuple[list[Linkage], list[Loop]]:
    """Return the planar linkages and the spatial loops of a mechanism."""
    planar, spatial = _linkages(mechanism)
    return [*planar], [*spatial]


@lru_cache(maxsize=MECHANISMS)
def _linkages(mechanism: Mechanism) -> tuple[list[Linkage], list[Loop]]:
    terms = Terms({p.symbol: p.value for p in mechanism.parameters})
    planar: list[_PlanarLoop] = []
    spatial: list[Loop] = []
    for loop in loops(mechanism):
        normal = _normal(mechanism, loop, terms)
        if normal is None:
            spatial.append(loop)
        else:
            planar.append(_PlanarLoop(loop, normal))
    return [_linkage(mechanism, terms, group) for group in _sharing(planar)], spatial


class _PlanarLoop(NamedTuple):
    """A planar loop.

    The normal of the plane is numeric and expressed in the frame of the base body.
    """

    loop: Loop
    normal: sp.Matrix

    def shares_with(self, other: "_PlanarLoop") -> bool:
        """Whether two loops share a joint and a plane."""
        names = {joint.name for joint in self.loop.joints}
        shared = any(joint.name in names for joint in other.loop.joints)
        return shared and _is_small(self.normal.cross(other.normal))


def _sharing(planar: Sequence[_PlanarLoop]) -> list[list[Loop]]:
    """Group loops that share joints, in the order of the description."""
    groups: list[list[_PlanarLoop]] = []
    for loop in planar:
        joined = [group for group in groups if any(loop.shares_with(other) for other in group)]
        merged = [member for group in joined for member in group] + [loop]
        groups = [group for group in groups if group not in joined] + [merged]
    return [[member.loop for member in planar if member in group] for group in groups]


# --- planarity of a loop ---


class _Pose(NamedTuple):
    R: sp.Matrix
    p: sp.Matrix

    def onward(self, terms: Terms, placement: Placement) -> "_Pose":
        """Return the pose multiplied from the right by the matrix of a placement."""
        M = placement_matrix(placement).applyfunc(terms.value)
        return _Pose(self.R * M[:3, :3], self.p + self.R * M[:3, 3])


class _Branch:
    """Joint axes and end frame of one branch of a loop, in the frame of the base body."""

    def __init__(
        self, mechanism: Mechanism, terms: Terms, frame: Frame, path: Sequence[Joint]
    ) -> None:
        self.turning: list[sp.Matrix] = []
        self.sliding: list[sp.Matrix] = []
        self.is_helical = False
        for joint in path:
            self._pass(joint, _before(mechanism, terms, joint).R[:, 2])
        self.R, self.p = _at(mechanism, terms, frame.body).onward(terms, frame.placement)

    def _pass(self, joint: Joint, axis: sp.Matrix) -> None:
        self.is_helical |= joint.kind == "helical"
        if joint.kind in ("revolute", "helical"):
            self.turning.append(axis)
        elif joint.kind == "prismatic":
            self.sliding.append(axis)


def _normal(mechanism: Mechanism, loop: Loop, terms: Terms) -> sp.Matrix | None:
    """Return a planar loop's normal in the frame of the base body, or None for a spatial loop."""
    loop_joint = loop.loop_joint
    a = _Branch(mechanism, terms, loop_joint.a, loop.to_a)
    b = _Branch(mechanism, terms, loop_joint.b, loop.to_b)
    turning, sliding = [*a.turning, *b.turning], [*a.sliding, *b.sliding]
    kind = loop_joint.kind if isinstance(loop_joint, Closure) else "ball"
    if kind == "pin":
        turning += [a.R[:, 2], b.R[:, 2]]
    elif kind == "slider":
        sliding += [a.R[:, 2], b.R[:, 2]]
    n = turning[0] if turning else across(sliding, terms.value)
    if n is None or a.is_helical or b.is_helical:
        return None
    # A slider or weld allows no rotation, so its end frames must have the same plane normal.
    kept = kind not in ("slider", "weld") or _is_small(a.R.T * n - b.R.T * n)
    is_planar = kept and holds(n, turning, sliding) and abs(n.dot(b.p - a.p)) < ZERO_COMPONENT
    return n if is_planar else None


def axes_in_numbers(
    mechanism: Mechanism, terms: Terms, loop: Loop
) -> tuple[list[str], list[Vector], tuple[Vector, Vector]]:
    """Return the names and axes of a loop's revolute and helical joints, and the loop ends.

    All vectors are in the frame of the base body (meter).
    """
    branches = [
        (_Branch(mechanism, terms, frame, path), path)
        for frame, path in ((loop.loop_joint.a, loop.to_a), (loop.loop_joint.b, loop.to_b))
    ]
    turning = ("revolute", "helical")
    names = [joint.name for _, path in branches for joint in path if joint.kind in turning]
    axes = [axis for branch, _ in branches for axis in branch.turning]
    a, b = (_in_numbers(branch.p) for branch, _ in branches)
    return names, [_in_numbers(axis) for axis in axes], (a, b)


def _in_numbers(vector: sp.Matrix) -> Vector:
    return np.array([float(entry) for entry in vector])


def holds(n: sp.Matrix, turning: Iterable[sp.Matrix], sliding: Iterable[sp.Matrix]) -> bool:
    """Whether the revolute axes are parallel to n and the prismatic axes perpendicular to n."""
    return all(_is_small(n.cross(axis)) for axis in turning) and all(
        abs(n.dot(axis)) < ZERO_COMPONENT for axis in sliding
    )


def across(sliding: Sequence[sp.Matrix], value: Callable[[sp.Expr], sp.Expr]) -> sp.Matrix | None:
    """Return the unit normal of the plane of two sliders, or None if all sliders are parallel.

    Args:
        sliding: Directions of the sliders.
        value: Function that evaluates a vector component numerically.
    """
    for other in sliding[1:]:
        n = sliding[0].cross(other)
        if not _is_small(n.applyfunc(value)):
            return n / sp.sqrt(n.dot(n))
    return None


def _at(mechanism: Mechanism, terms: Terms, body: str) -> _Pose:
    """Return the pose of a body with all joints at zero."""
    if body == mechanism.base_frame:
        return _Pose(sp.eye(3), sp.zeros(3, 1))
    joint = mechanism.joint_of[body]
    return terms.memoize(
        ("after joint at zero", mechanism, joint),
        lambda: _before(mechanism, terms, joint).onward(terms, joint.after),
    )


def _before(mechanism: Mechanism, terms: Terms, joint: Joint) -> _Pose:
    """Return the pose of a joint's axes with all joints at zero."""
    return terms.memoize(
        ("before joint at zero", mechanism, joint),
        lambda: _at(mechanism, terms, joint.parent).onward(terms, joint.before),
    )


def _is_small(vector: sp.Matrix) -> bool:
    return all(abs(entry) < ZERO_COMPONENT for entry in vector)


# --- the linkage's plane ---


def _linkage(mechanism: Mechanism, terms: Terms, group: Sequence[Loop]) -> Linkage:
    joints = {joint.name: joint for loop in group for joint in (*loop.to_a, *loop.to_b)}
    order = [joint for joint in mechanism.joints if joint.name in joints]
    root = next(joint.parent for joint in order if joint.parent not in {j.link for j in order})
    plane = _Plane(terms, root, order, group)
    edges: list[Edge] = [plane.edge(joint) for joint in order]
    bodies = [root, *(joint.link for joint in order)]
    for loop in group:
        if isinstance(loop.loop_joint, Closure):
            edges.append(plane.closure(loop.loop_joint))
        else:
            edges.extend(plane.strut(loop.loop_joint))
            bodies.append(loop.loop_joint.name)
            if loop.loop_joint.is_cylinder:
                bodies.append(piston(loop.loop_joint))
    moving = [joint.name for joint in order if joint.kind != "fixed"]
    cylinders = [
        loop.loop_joint.name
        for loop in group
        if isinstance(loop.loop_joint, Strut) and loop.loop_joint.is_cylinder
    ]
    loop_joints = tuple(loop.loop_joint.name for loop in group)
    return Linkage(
        root, tuple(bodies), tuple(edges), (*moving, *cylinders), loop_joints, plane.axes
    )


def piston(cylinder: Strut) -> str:
    """Return the name of the piston body of a cylinder."""
    return f"{cylinder.name}.piston"


def is_cylinder(edge: Edge) -> bool:
    """Whether an edge is the prismatic joint inside a cylinder."""
    return isinstance(edge, SlideEdge) and edge.b == f"{edge.a}.piston"


class _Plane:
    """The plane of a linkage, which converts joints, closures and struts to planar edges."""

    def __init__(
        self, terms: Terms, root: str, order: Sequence[Joint], group: Sequence[Loop]
    ) -> None:
        self.terms = terms
        self.axes: dict[str, Axes] = {}
        self.axes[root] = self._chosen(tidied(terms, self._normal_at_root(order, group)))
        for joint in order:
            R = _rotation(joint.before) * _rotation(joint.after)
            normal = tidied(terms, R.T * self.axes[joint.parent].n)
            self.axes[joint.link] = self._chosen(normal)

    def _normal_at_root(self, order: Sequence[Joint], group: Sequence[Loop]) -> sp.Matrix:
        """Return the plane normal: the first revolute axis, or the common normal of the sliders."""
        for joint in order:
            if joint.kind == "revolute":
                return self._at_root(joint.parent, _rotation(joint.before)[:, 2], order)
        closures = [loop.loop_joint for loop in group if isinstance(loop.loop_joint, Closure)]
        for closure in closures:
            if closure.kind == "pin":
                return self._at_root(closure.a.body, _axis(closure.a), order)
        sliding = [
            self._at_root(joint.parent, _rotation(joint.before)[:, 2], order)
            for joint in order
            if joint.kind == "prismatic"
        ]
        sliding += [
            self._at_root(closure.a.body, _axis(closure.a), order)
            for closure in closures
            if closure.kind == "slider"
        ]
        n = across(sliding, self.terms.value)
        assert n is not None
        return n

    def _at_root(self, body: str, direction: sp.Matrix, order: Sequence[Joint]) -> sp.Matrix:
        """Convert a direction from a body frame to the root frame, with all joint values zero."""
        for joint in joints_to_root({joint.link: joint for joint in order}, body):
            direction = _rotation(joint.before) * _rotation(joint.after) * direction
        return direction

    def _chosen(self, n: sp.Matrix) -> Axes:
        for k in range(3):
            if not n[k].free_symbols and abs(self.terms.value(n[k])) < ZERO_COMPONENT:
                x = sp.eye(3)[:, k]
                return Axes(x, tidied(self.terms, n.cross(x)), n)
        x = n.cross(sp.Matrix([0, 0, 1]))
        x = x / sp.sqrt(x.dot(x))
        return Axes(x, tidied(self.terms, n.cross(x)), n)

    def point(self, body: str, position: sp.Matrix) -> Complex:
        """Convert a point or direction from a body frame to the planar axes of the body."""
        axes = self.axes[body]
        sums = (sp.Add(*(axis[k] * position[k] for k in range(3))) for axis in (axes.x, axes.y))
        x, y = (tidied_entry(self.terms, sp.expand(component)) for component in sums)
        return x, y

    def edge(self, joint: Joint) -> Edge:
        """Return the planar edge that represents a tree joint."""
        before, after = placement_matrix(joint.before), placement_matrix(joint.after)
        R, p = after[:3, :3], after[:3, 3]
        a, b = joint.parent, joint.link
        rotor = self.point(a, before[:3, :3] * R * self.axes[b].x)
        at_a, at_b = self.point(a, before[:3, 3]), self.point(b, -R.T * p)
        axis = before[:3, 2] * joint.direction
        if joint.kind == "fixed":
            origin = self.point(a, before[:3, 3] + before[:3, :3] * p)
            return WeldEdge(joint.name, a, origin, b, rotor)
        if joint.kind == "prismatic":
            return SlideEdge(joint.name, a, at_a, self.point(a, axis), b, at_b, rotor)
        sense = 1 if self.terms.value(axis.dot(self.axes[a].n)) > 0 else -1
        return PinEdge(joint.name, a, at_a, b, at_b, rotor, sense)

    def closure(self, closure: Closure) -> Edge:
        """Return the planar edge that represents a closure."""
        (a, M), (b, N) = self._placed(closure.a), self._placed(closure.b)
        at_a, at_b = self.point(a, M[:3, 3]), self.point(b, N[:3, 3])
        rotor = self.point(a, M[:3, :3] * N[:3, :3].T * self.axes[b].x)
        if closure.kind == "weld":
            p = M[:3, 3] - M[:3, :3] * N[:3, :3].T * N[:3, 3]
            return WeldEdge(closure.name, a, self.point(a, p), b, rotor)
        if closure.kind == "slider":
            return SlideEdge(closure.name, a, at_a, self.point(a, M[:3, 2]), b, at_b, rotor)
        return PinEdge(closure.name, a, at_a, b, at_b)

    def strut(self, strut: Strut) -> list[Edge]:
        """Return the planar edges that represent a strut.

        A cylinder adds a sliding edge between its two pins.
        """
        (a, M), (b, N) = self._placed(strut.a), self._placed(strut.b)
        barrel = strut.name
        swing = PinEdge(strut.swing_name, a, self.point(a, M[:3, 3]), barrel, (ZERO, ZERO))
        far = self.point(b, N[:3, 3])
        end: Complex = (strut.length, ZERO)
        if not strut.is_cylinder:
            return [swing, PinEdge(f"{strut.name}.end", barrel, end, b, far)]
        moving = piston(strut)
        return [
            swing,
            SlideEdge(strut.name, barrel, end, (ONE, ZERO), moving, (ZERO, ZERO)),
            PinEdge(f"{strut.name}.end", moving, (ZERO, ZERO), b, far),
        ]

    def _placed(self, frame: Frame) -> tuple[str, sp.Matrix]:
        return frame.body, placement_matrix(frame.placement)


def _rotation(placement: Placement) -> sp.Matrix:
    return placement_matrix(placement)[:3, :3]


def _axis(frame: Frame) -> sp.Matrix:
    return _rotation(frame.placement)[:, 2]


def tidied(terms: Terms, vector: sp.Matrix) -> sp.Matrix:
    """Return a vector after rounding entries that are 0, 1 or -1 up to rounding errors.

    Entries with parameters stay as they are.
    """
    return vector.applyfunc(lambda entry: tidied_entry(terms, sp.expand(entry)))


def tidied_entry(terms: Terms, entry: sp.Expr) -> sp.Expr:
    """Return an entry, or the exact integer if it is 0, 1 or -1 up to rounding errors."""
    if entry.is_Rational or entry.free_symbols:
        return entry
    value = terms.value(entry)
    for integer in (0, 1, -1):
        if abs(value - integer) < ZERO_COMPONENT:
            return sp.Integer(integer)
    return entry
