"""Numeric tree of a robot's rigid bodies, with joints, struts and tip frame.

The pose of a body in the base frame follows from the pose of its parent body:

    T_0_body = T_0_parent * placement * motion(ratio * z[coordinate] + offset)

In this formula, z is the full configuration of a robot with loops, or the coordinates q of a serial
robot. The joint motion is a rotation about the joint axis or a translation along this axis. If
several coordinates move one joint, the tree contains one body per coordinate, each with its own
joint motion. A strut connects two bodies. The z axes of the sections of a strut are along the
strut.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chasles.contract import BodyJoint, ClosureFrames, Span

from ..model.coupling import Limits
from ..model.mechanism import Closure, Described, Frame, Mechanism, Strut
from ..model.placements import Placement, inverse
from ..model.robot import Joint
from ..model.tolerances import PIN_ACROSS
from ..terms.terms import Terms
from .poe import placement_matrix

Array = NDArray[np.float64]
Vector = tuple[float, ...]


@dataclass(frozen=True)
class TreeBody:
    """A body on a joint, or a section of a strut.

    Attributes:
        name: Unique name of the body.
        parent: Index of the parent body, which carries the joint, or -1 for the ground and for
            strut sections.
        placement: The body frame in the parent frame at joint value 0 (4, 4).
        joint: The joint that moves the body, or None for the ground and strut sections.
        span: The two end points of the strut if the body is a strut section, otherwise None.
        limits: Minimum and maximum of the coordinate that moves the body. A missing limit is None.
        is_part: Whether the next body belongs to the same joint, because several coordinates move
            this joint.
    """

    name: str
    parent: int
    placement: Array
    joint: BodyJoint | None = None
    span: Span | None = None
    limits: tuple[float | None, float | None] = (None, None)
    is_part: bool = False


class RigidBodies:
    """The rigid bodies of a robot description.

    The list of bodies starts with the ground, followed by the bodies on joints and the strut
    sections.

    Attributes:
        robot: The description.
        bodies: All bodies, with each parent body before its children.
        index: The index of each body, keyed by its name in the description.
        names: The names of the coordinates that move the bodies.
        poses: Pose of each body on a joint in the reference configuration, relative to the base
            frame (4, 4).
        tip: Index of the body that carries the tip frame of the robot.
        tip_placement: The tip frame in the frame of the tip body (4, 4).
        size: Size of the robot (meter): diagonal of the bounding box of frames, joints and tip in
            the reference configuration.
    """

    def __init__(self, robot: Described, terms: Terms, reference: Mapping[str, float]) -> None:
        """Read the description."""
        self.robot, self.terms, self.reference = robot, terms, reference
        self.names = tuple(reference)
        self.bodies = [TreeBody(robot.base_frame, -1, np.eye(4))]
        self.index = {robot.base_frame: 0}
        for joint, link in zip(robot.joints, _links(robot), strict=True):
            is_tree = isinstance(robot, Mechanism)
            parent = self.index[joint.parent] if is_tree else len(self.bodies) - 1
            self._add(joint, link, parent)
        self.poses = tree_poses(self.bodies, list(reference.values()))
        last = len(self.bodies) - 1
        self.tip = self.index[robot.tool_body] if isinstance(robot, Mechanism) else last
        self.tip_placement = self._on(self.tip, robot.tool)
        self.size = self._size()

    def _add(self, joint: Joint, link: str, parent: int) -> None:
        placement = self._on(parent, joint.before + joint.after)
        back = placed(self.terms, inverse(joint.after))
        *parts, own = self._motions(joint, vector(back[:3, 3]), vector(back[:3, 2]))
        motion, bounds = own
        for part, limits in parts:
            name = f"{link}_by_{self.names[part.coordinate]}"
            body = TreeBody(name, parent, placement, part, limits=limits, is_part=True)
            self.bodies.append(body)
            parent, placement = len(self.bodies) - 1, np.eye(4)
        self.index[link] = len(self.bodies)
        self.bodies.append(TreeBody(link, parent, placement, motion, limits=bounds))

    def _motions(
        self, joint: Joint, at: Vector, axis: Vector
    ) -> list[tuple[BodyJoint, tuple[float | None, float | None]]]:
        if joint.kind == "fixed":
            return [(BodyJoint(joint.name, joint.kind, at, axis), (None, None))]
        value = self.terms.value
        advance = float(value(joint.pitch)) if joint.kind == "helical" else 0.0
        moved = self._moved(joint)
        found = []
        for last, (k, ratio, limits) in zip(range(1 - len(moved), 1), moved, strict=True):
            low, high = (None if limit is None else float(value(limit)) for limit in limits)
            offset = self._offset(joint) if last == 0 else 0.0
            part = BodyJoint(joint.name, joint.kind, at, axis, k, ratio, offset, advance)
            found.append((part, (low, high)))
        return found

    def _moved(self, joint: Joint) -> list[tuple[int, float, Limits]]:
        if isinstance(self.robot, Mechanism) or not self.robot.couplings:
            return [(self.names.index(joint.name), float(joint.direction), joint.limits)]
        row = list(
            self.robot.linear_map.C.row([j.name for j in self.robot.moving].index(joint.name))
        )
        # A joint with a constant value refers to the first coordinate and has the coupling ratio 0.
        moving = [k for k, ratio in enumerate(row) if ratio != 0] or [0]
        coordinates = self.robot.coordinates
        return [(k, float(joint.direction * row[k]), coordinates[k].limits) for k in moving]

    def _offset(self, joint: Joint) -> float:
        if isinstance(self.robot, Mechanism) or not self.robot.couplings:
            return 0.0
        k = [j.name for j in self.robot.moving].index(joint.name)
        return float(joint.direction * self.robot.linear_map.c[k])

    def _size(self) -> float:
        points = [(self.poses[self.tip] @ self.tip_placement)[:3, 3]]
        for T, body in zip(self.poses, self.bodies, strict=True):
            points += [T[:3, 3], *([T[:3, :3] @ body.joint.at + T[:3, 3]] if body.joint else [])]
        loop_joints = self.robot.loop_joints if isinstance(self.robot, Mechanism) else ()
        for loop_joint in loop_joints:
            ends = (self.end(frame) for frame in (loop_joint.a, loop_joint.b))
            points += [(self.poses[k] @ T)[:3, 3] for k, T in ends]
        found = float(np.linalg.norm(np.ptp(np.array(points), axis=0)))
        return found if found > 0 else 1.0

    def turns(self, coordinate: str) -> bool:
        """Whether a coordinate is an angle."""
        index = self.names.index(coordinate)
        joints = [body.joint for body in self.bodies if body.joint]
        return any(j.coordinate == index and j.kind != "prismatic" for j in joints)

    def end(self, frame: Frame) -> tuple[int, Array]:
        """Return the index of a frame's body, and the pose of the frame in this body (4, 4)."""
        k = self.index[frame.body]
        return k, self._on(k, frame.placement)

    def _on(self, body: int, placement: Placement) -> Array:
        return placed(self.terms, (*self.robot.base, *placement) if body == 0 else placement)

    def closure_frames(self, closure: Closure) -> ClosureFrames:
        """Return the two frames that a loop-closing joint connects."""
        (a, A), (b, B) = self.end(closure.a), self.end(closure.b)
        return ClosureFrames(closure.name, closure.kind, (a, b), (pose_rows(A), pose_rows(B)))

    def span(self, strut: Strut, *, from_end: bool = False) -> Span:
        """Return the end points of a strut.

        At a pin joint, the y axis of the strut is the pin axis.
        """
        (a, A), (b, B) = self.end(strut.a), self.end(strut.b)
        displacement = (self.poses[b] @ B)[:3, 3] - (self.poses[a] @ A)[:3, 3]
        parts = np.abs(self.poses[a][:3, :3].T @ displacement)
        # In planar mechanisms, a frame that defines only the position of a strut end has its z axis
        # in the plane.
        length = max(float(np.linalg.norm(displacement)), 1e-300)
        along = abs(displacement @ self.poses[a][:3, :3] @ A[:3, 2]) / length
        is_pin = strut.ends == "pin" and along < PIN_ACROSS
        across = A[:3, 2] if is_pin else self._aside(parts)
        ends = vector(A[:3, 3]), vector(B[:3, 3])
        return Span(strut.name, (a, b), ends, vector(across), from_end)

    @staticmethod
    def _aside(parts: Array) -> Array:
        # The components of the strut direction are rounded, because their rounding errors differ
        # between computers.
        found: Array = np.eye(3)[int(np.argmin(np.round(parts / max(parts.max(), 1e-300), 6)))]
        return found


def pose_rows(T: Array) -> tuple[Vector, ...]:
    """Return the first three rows of a pose as nested tuples."""
    return tuple(vector(row) for row in T[:3])


def vector(values: Array) -> Vector:
    """Return a vector as a tuple of floats."""
    return tuple(float(value) + 0.0 for value in values)


def placed(terms: Terms, placement: Placement) -> Array:
    """Return the placement matrix (4, 4) in double precision."""
    exact = placement_matrix(placement)
    rows = [[float(terms.value(entry)) for entry in row] for row in exact.tolist()]
    return np.array(rows) + 0.0


def motions(joint: BodyJoint, coordinates: Array) -> Array:
    """Return the poses (m, 4, 4) of a body relative to its own pose at joint value 0.

    Args:
        joint: The joint.
        coordinates: The coordinates that move the bodies (radian or meter), one row per
            configuration (m, n).
    """
    T = np.tile(np.eye(4), (len(coordinates), 1, 1))
    if joint.kind == "fixed":
        return T
    value = (joint.ratio * coordinates[:, joint.coordinate] + joint.offset)[:, None]
    if joint.kind == "prismatic":
        T[:, :3, 3] = value * joint.axis
        return T
    K, turn = skew(joint.axis), value[:, :, None]
    T[:, :3, :3] += np.sin(turn) * K + (1 - np.cos(turn)) * (K @ K)
    T[:, :3, 3] = joint.at - T[:, :3, :3] @ joint.at + joint.advance * value * joint.axis
    return T


def tree_poses(bodies: Sequence[TreeBody], values: Sequence[float]) -> list[Array]:
    """Return the poses (4, 4) of all bodies except strut sections, in the base frame.

    Args:
        bodies: The bodies of the robot. The function skips strut sections.
        values: The full configuration z of a robot with loops, or the coordinates q of a serial
            robot (radian or meter).
    """
    poses, row = [np.eye(4)], np.array([values])
    for body in bodies[1:]:
        if body.joint is not None:
            poses.append(poses[body.parent] @ body.placement @ motions(body.joint, row)[0])
    return poses


def skew(w: Array | Vector) -> Array:
    """Return the cross-product matrix (3, 3) of a vector."""
    x, y, z = w
    return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def _links(robot: Described) -> Sequence[str]:
    if isinstance(robot, Mechanism):
        return [joint.link for joint in robot.joints]
    return robot.link_names
