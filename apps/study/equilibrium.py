"""Equations of static equilibrium of the rigid bodies of a robot.

A wrench is (force, moment about the base origin) in base axes. The power of a wrench on a body is
the scalar product of the wrench and the twist (v, omega) of the body at the base origin. The vector
x contains the unknown loads of struts, joint couplings and closures (joints that close loops). For
each coordinate j of the joint tree, the virtual work of all forces is 0:

    G_j x + Q_j + tau_j = 0

In this equation, Q_j is the generalized force of the weights and the tool wrench on coordinate j.
The actuator force tau_j on coordinate j is 0 if the coordinate has no actuator. The equations of
the coordinates without actuators determine the unknown loads x.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chasles import InputValueError, Robot
from chasles.contract import BodyJoint, ClosureFrames, Span

from ..drawing.skeleton import Skeleton
from .tolerances import STATICALLY_SINGULAR

FloatArray = NDArray[np.float64]
_FORCES = {"pin": (0, 1, 2), "ball": (0, 1, 2), "slider": (0, 1), "weld": (0, 1, 2)}
_MOMENTS = {"pin": (0, 1), "ball": (), "slider": (0, 1, 2), "weld": (0, 1, 2)}
"""For each type of closure, `_FORCES` contains the indices of the closure frame axes along which
the closure transmits forces. `_MOMENTS` contains the indices of the axes about which the closure
transmits moments."""


@dataclass(frozen=True)
class PointMass:
    """A point mass on a link or on a strut section (a rod, or the barrel or piston of a cylinder).

    Attributes:
        link: Name of the link or strut section, such as `boom_cylinder_barrel`. The list
            `chasles.drawing.skeleton(robot).bodies` contains all names.
        mass: Mass [kg].
        at: (3,) center of mass in the frame of the link or section [m]. The z axis of a strut
            section points from the first end of the strut to the second. On a strut section, the x
            and y coordinates of the center of mass are 0.
    """

    link: str
    mass: float
    at: Sequence[float] = (0.0, 0.0, 0.0)


class Equilibrium:
    """The equations of static equilibrium of all bodies of a robot, at m configurations.

    Attributes:
        robot: The robot.
        skeleton: The rigid bodies of the robot.
        poses: (m, bodies, 4, 4) pose of each body in the base frame.
        screws: (m, bodies, 6) twist (v, omega) of each joint per unit of the joint value.
        carries: (bodies, bodies) mask whose entry (i, j) is true if the joint of body i moves body
            j.
        coordinates: Indices of the joint-tree coordinates in the configuration vector z, or in q
            for a serial robot.
        ratios: (bodies, coordinates) change of the joint value of each body per unit of each
            coordinate.
        lengths: (coordinates,) reference length of each coordinate: the robot size [m] for an
            angle, and 1 for a length.
        struts: The struts (rods and cylinders), keyed by name.
        cylinders: Names of the cylinders, which are the struts with two sections.
        driven: One pair (driven element, ratio) per actuator. The driven element is given by the
            name of a strut, or by the row index of a coordinate in G. The ratio is the motion of
            the driven element per unit of q.
        free_rows: Row indices in G of the coordinates without actuators.
        unknowns: For each unknown load in x, the name of the strut, closure or coupling that
            transmits the load.
        unit_wrenches: One array (m, bodies, 6) per unknown load, with the wrenches that a unit
            value of this load exerts on all bodies.
        G: (m, coordinates, unknowns) virtual work of the unit wrenches per unit of each coordinate.
    """

    def __init__(self, robot: Robot, skeleton: Skeleton, poses: FloatArray) -> None:
        """Set up the equilibrium equations for body poses, which must not contain NaN."""
        self.robot, self.skeleton, self.poses = robot, skeleton, poses
        tree = [body for body in skeleton.bodies if body.span is None]
        self.carries = np.eye(len(tree), dtype=bool)
        for k, body in enumerate(tree):
            if body.parent is not None:
                self.carries[:, k] |= self.carries[:, body.parent]
        moving = [(k, b.joint) for k, b in enumerate(tree) if b.joint and b.joint.kind != "fixed"]
        self.coordinates = sorted({joint.coordinate for _, joint in moving})
        self.ratios = np.zeros((len(tree), len(self.coordinates)))
        self.lengths = np.ones(len(self.coordinates))
        self.screws = np.zeros((len(poses), len(tree), 6))
        for k, joint in moving:
            column = self.coordinates.index(joint.coordinate)
            self.ratios[k, column] = joint.ratio
            self.screws[:, k] = self._screw(k, joint)
            if joint.kind != "prismatic":
                self.lengths[column] = skeleton.size
        spans = [body.span for body in skeleton.bodies if body.span]
        self.struts = {span.name: span for span in spans}
        self.cylinders = {span.name for span in spans if span.from_end}
        self.driven = self._driven()
        places = [place for place, _ in self.driven]
        self.free_rows = [k for k in range(len(self.coordinates)) if k not in places]
        # A cylinder without an actuator transmits no force.
        rods = [name for name in self.struts if name not in self.cylinders or name in places]
        self.unknowns = rods.copy()
        self.unit_wrenches = [self._strut_wrenches(name) for name in rods]
        for closure in skeleton.closures:
            wrenches = self._closure_wrenches(closure)
            self.unknowns += [closure.name] * len(wrenches)
            self.unit_wrenches += wrenches
        for row in self.robot.manifest.loops.joint_couplings:
            self.unknowns.append(self._coupling_name(row))
            self.unit_wrenches.append(self._coupling_wrenches(row, moving))
        self.G = np.zeros((len(poses), len(self.coordinates), len(self.unknowns)))
        for k, wrenches_of_one in enumerate(self.unit_wrenches):
            self.G[..., k] = self.work(wrenches_of_one)

    def _screw(self, body: int, joint: BodyJoint) -> FloatArray:
        axis = self.poses[:, body, :3, :3] @ np.array(joint.axis)
        if joint.kind == "prismatic":
            return np.concatenate([axis, np.zeros_like(axis)], -1)
        v = np.cross(self.points(body, joint.at), axis) + joint.advance * axis
        return np.concatenate([v, axis], -1)

    def _driven(self) -> list[tuple[str | int, float]]:
        names = [variable.name for variable in self.robot.configuration_variables]
        if not names:
            return [(k, 1.0) for k in range(self.robot.n)]
        found: list[tuple[str | int, float]] = []
        for item in self.robot.manifest.loops.actuated_in_z:
            name = names[item.index]
            place = name if name in self.struts else self.coordinates.index(item.index)
            found.append((place, item.ratio))
        return found

    def coordinate_name(self, row: int) -> str:
        """Return the name of the coordinate that belongs to a row of the virtual work matrix G."""
        variables = self.robot.configuration_variables or self.robot.coordinates
        return variables[self.coordinates[row]].name

    def points(self, body: int, at: Iterable[float]) -> FloatArray:
        """Return the positions (m, 3) of a point of a body in the base frame."""
        T = self.poses[:, body]
        return np.asarray(T[:, :3, :3] @ np.array([*at]) + T[:, :3, 3])

    def work(self, wrenches: FloatArray) -> FloatArray:
        """Return the generalized forces (m, coordinates) of wrenches (m, bodies, 6) on bodies."""
        on_joints = (self.screws * (self.carries @ wrenches)).sum(-1)
        return np.asarray(on_joints @ self.ratios)

    def wrenches(self, x: FloatArray) -> FloatArray:
        """Return the wrenches (m, bodies, 6) that the unknown loads x exert on the bodies."""
        found = self._zeros()
        for k, wrenches in enumerate(self.unit_wrenches):
            found += x[:, k, None, None] * wrenches
        return found

    def _zeros(self) -> FloatArray:
        return np.zeros_like(self.screws)

    def ends(self, span: Span) -> tuple[FloatArray, FloatArray]:
        """Return the positions (m, 3) of both ends of a strut."""
        a, b = (self.points(k, at) for k, at in zip(span.bodies, span.ends, strict=True))
        return a, b

    def _strut_wrenches(self, name: str) -> FloatArray:
        """Return the wrenches that a strut with unit force exerts on the bodies at its ends."""
        span, found = self.struts[name], self._zeros()
        a, b = self.ends(span)
        u = (b - a) / np.linalg.norm(b - a, axis=-1, keepdims=True)
        found[:, span.bodies[0]] -= on_line(u, a)
        found[:, span.bodies[1]] += on_line(u, b)
        return found

    def _closure_wrenches(self, closure: ClosureFrames) -> list[FloatArray]:
        """Return the wrenches of all unit forces and unit moments that a closure transmits."""
        (a, b), frame = closure.bodies, np.array(closure.frames[1])
        R = self.poses[:, b, :3, :3] @ frame[:, :3]
        at, normal = self.points(b, frame[:, 3]), self._normal(closure, R[..., 2])
        if normal is None:
            forces = [R[..., axis] for axis in _FORCES[closure.kind]]
            moments = [R[..., axis] for axis in _MOMENTS[closure.kind]]
        else:
            forces, moments = _in_plane(closure.kind, R[..., 2], normal)
        size = self.skeleton.size
        units = [on_line(force, at) for force in forces]
        units += [np.concatenate([0 * m, size * m], -1) for m in moments]
        found = []
        for unit in units:
            both = self._zeros()
            both[:, a] -= unit
            both[:, b] += unit
            found.append(both)
        return found

    def _coupling_name(self, row: Sequence[float]) -> str:
        names = [variable.name for variable in self.robot.configuration_variables]
        coupled = [name for name, factor in zip(names, row, strict=True) if factor]
        cylinders = [name for name in coupled if name in self.struts]
        if cylinders:
            raise InputValueError(
                f"{self.robot.name}: the force of a coupled cylinder is unknown; expected "
                f"couplings of tree joints only, got cylinder {cylinders[0]!r}"
            )
        return f"coupling of {', '.join(coupled)}"

    def _coupling_wrenches(
        self, row: Sequence[float], moving: Iterable[tuple[int, BodyJoint]]
    ) -> FloatArray:
        """Return the wrenches of a joint coupling on the bodies, such as the torques of two gears.

        Each coupling torque or force acts between the two links of a joint, along the joint axis.
        """
        found, tree = self._zeros(), self.skeleton.bodies
        for k, joint in moving:
            axis = self.poses[:, k, :3, :3] @ np.array(joint.axis)
            axis = axis * (row[joint.coordinate] / joint.ratio)
            moment = np.concatenate([0 * axis, axis], -1)
            unit = on_line(axis, self.points(k, joint.at)) if joint.kind == "prismatic" else moment
            found[:, k] += self.skeleton.size * unit
            if (parent := tree[k].parent) is not None:
                found[:, parent] -= self.skeleton.size * unit
        return found

    def _normal(self, closure: ClosureFrames, axis: FloatArray) -> FloatArray | None:
        """Return the normal (m, 3) of the plane in which a loop moves, or None.

        The function returns None if the loop has no rotating joint, or does not move in one plane.

        The closure of a planar loop is assumed to transmit forces in the plane only. If the closure
        also transmitted a normal force and moments about axes in the plane, these loads would be
        statically indeterminate.
        """
        a, b = closure.bodies
        path = np.flatnonzero(self.carries[:, a] ^ self.carries[:, b])
        turning = [k for k in path if self.screws[0, k, 3:].any()]
        if not turning:
            return None
        normal = self.screws[:, turning[0], 3:]
        sliding = [self.screws[0, k, :3] for k in path if not self.screws[0, k, 3:].any()]
        along = [self.screws[0, k, 3:] for k in turning]
        if closure.kind == "pin":
            along.append(axis[0])
        elif closure.kind == "slider":
            sliding.append(axis[0])
        off = [np.linalg.norm(np.cross(normal[0], x)) for x in along]
        off += [np.abs(normal[0] @ x) for x in sliding]
        return normal if max(off) < STATICALLY_SINGULAR else None

    def weights(self, masses: Sequence[PointMass], gravity: FloatArray) -> FloatArray:
        """Return the wrenches (m, bodies of the joint tree, 6) of the weights of point masses."""
        index = {body.name: k for k, body in enumerate(self.skeleton.bodies)}
        found = self._zeros()
        for mass in masses:
            k, force = index[mass.link], mass.mass * gravity
            span, at = self.skeleton.bodies[k].span, self.points(k, mass.at)
            if span is None:
                found[:, k] += on_line(np.broadcast_to(force, at.shape), at)
                continue
            for body, part, end in self._on_ends(span, at, force):
                found[:, body] += on_line(part, end)
        return found

    def _on_ends(
        self, span: Span, at: FloatArray, force: FloatArray
    ) -> list[tuple[int, FloatArray, FloatArray]]:
        """Split a force at a point on the axis of a strut into forces on the two ends.

        The lever rule distributes the transverse component of the force to both ends of the strut.
        An axial force on the barrel of a cylinder acts only on the end of the barrel. An axial
        force on the piston acts only on the end of the piston. An axial force on a rod is divided
        equally between its two ends.
        """
        a, b = self.ends(span)
        length = np.linalg.norm(b - a, axis=-1, keepdims=True)
        u = (b - a) / length
        s = ((at - a) * u).sum(-1, keepdims=True) / length
        axial = (u @ force)[:, None] * u
        to_b = float(span.from_end) if span.name in self.cylinders else 0.5
        across = force - axial
        return [
            (span.bodies[0], (1 - s) * across + (1 - to_b) * axial, a),
            (span.bodies[1], s * across + to_b * axial, b),
        ]

    def tool(self, wrench: FloatArray) -> FloatArray:
        """Return the wrenches on all bodies due to a tool force and torque (m, 6)."""
        found = self._zeros()
        tip = self.points(self.skeleton.tip, self.skeleton.tip_placement[:3, 3])
        found[:, self.skeleton.tip] = on_line(wrench[:, :3], tip)
        found[:, self.skeleton.tip, 3:] += wrench[:, 3:]
        return found


def on_line(force: FloatArray, at: FloatArray) -> FloatArray:
    """Return the wrenches (m, 6) of forces (m, 3) at points (m, 3)."""
    return np.concatenate([force, np.cross(at, force)], -1)


def _in_plane(
    kind: str, axis: FloatArray, normal: FloatArray
) -> tuple[list[FloatArray], list[FloatArray]]:
    """Return the directions (m, 3) of the forces and moments that a planar closure transmits."""
    if kind == "slider":
        return [np.cross(normal, axis)], [normal]
    first = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal[0]))])
    first /= np.linalg.norm(first, axis=-1, keepdims=True)
    return [first, np.cross(normal, first)], [normal] if kind == "weld" else []
