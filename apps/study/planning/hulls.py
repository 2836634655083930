"""The bodies of a robot as rounded shapes, and bounds of their motion.

The shapes of the bodies are the lines and plates of the robot's drawing. Each line of a body is a
capsule, and each plate is a rounded hull of its corners. Each rod or cylinder is a capsule between
its ends. If several joints connect the robot to the ground, the lines and plates that represent the
ground in the drawing are ignored.

The motion of a point is bounded by a sum over the joints between the base and the point. Each term
of the sum is a joint motion times the lever arm of the point at the middle of the motion. A joint
moves the point and all later axes as one rigid body, so the lever arms about the later axes do not
change. The motion bound of a point is a convex function of its position. The largest bound over the
corners of a shape therefore bounds the motion of the whole shape.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chasles import Robot
from chasles.contract import Body, requires
from chasles.summaries import short_repr, summary_repr

from ...drawing.skeleton import Skeleton, skeleton
from .obstacles import capsules_along

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]

_LINES = ("link", "guide", "ram")


@dataclass(frozen=True, eq=False)
class Hull:
    """The convex shape of a body or strut.

    Attributes:
        part: Name of the body or strut.
        bodies: (corners,) index of the body of each corner.
        corners: (corners, 3) position of each corner in the frame of its body [m].
    """

    part: str
    bodies: IntArray
    corners: FloatArray

    __repr__ = short_repr

    @property
    def is_strut(self) -> bool:
        """Whether the shape is a strut, with its ends on different bodies."""
        return bool((self.bodies != self.bodies[0]).any())


@dataclass(frozen=True, eq=False)
class Hulls:
    """The collision shapes of a robot's bodies and struts.

    Attributes:
        robot: The robot.
        skeleton: The bodies and joints of the robot.
        hulls: The collision shapes of the bodies and struts.
    """

    robot: Robot
    skeleton: Skeleton
    hulls: tuple[Hull, ...]

    def __repr__(self) -> str:
        """Short summary with the main values."""
        return summary_repr(
            self, self.robot.name, f"{len(self.hulls)} shapes on {', '.join(self.parts)}"
        )

    @property
    def parts(self) -> tuple[str, ...]:
        """Names of the bodies and struts that have shapes."""
        return tuple(dict.fromkeys(hull.part for hull in self.hulls))

    def configuration(self, q: FloatArray) -> FloatArray:
        """Return all joint values (m, n_z) at coordinates (m, n), or NaN for open loops."""
        return np.asarray(self.robot.configuration(q)) if self.robot.loops else q

    def corners(self, z: FloatArray) -> list[FloatArray]:
        """Return the corners (corners, 3) of each shape in the base frame at a configuration."""
        return np.split(self._corners(self.skeleton.poses_from_configuration(z)), self._ends[:-1])

    def shapes(self, radii: FloatArray) -> list[Any]:
        """Return the shapes of the hulls for the collision library coal, with the radii (hulls,).

        The list contains None for each strut.
        """
        with requires("chasles[planning]"):
            import coal  # noqa: PLC0415

        made: list[Any] = []
        for hull, radius in zip(self.hulls, radii, strict=True):
            if hull.is_strut:
                made.append(None)
            elif len(hull.corners) == 1:
                made.append(coal.Sphere(float(radius)))
            elif len(hull.corners) == 2:  # noqa: PLR2004 - a line has two ends
                length = float(np.linalg.norm(hull.corners[1] - hull.corners[0]))
                made.append(coal.Capsule(float(radius), length))
            else:
                made.append(_rounded(hull.corners, float(radius)))
        return made

    def poses(self, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the poses of the shapes at configurations (m, n_z).

        Returns:
            (m, hulls, 4, 4) poses of the shapes in the base frame, and (m, hulls) strut lengths
            [m]. A shape that is not a strut has the length 0.
        """
        T = self.skeleton.poses_from_configuration(z)
        found, lengths = T[:, self._first] @ self._placements, np.zeros((len(z), len(self.hulls)))
        if len(self._struts):
            a, b = (self._corners(T)[:, ends].reshape(-1, 3) for ends in self._strut_corners)
            along, placed = capsules_along(a, b)
            lengths[:, self._struts] = along.reshape(len(z), len(self._struts))
            found[:, self._struts] = placed.reshape(len(z), len(self._struts), 4, 4)
        return found, lengths

    def moves(self, z: FloatArray, w: FloatArray) -> FloatArray:
        """Return an upper bound on the displacement of each hull for joint values within a box.

        Args:
            z: (n_z,) configuration at the center of the box [rad or m].
            w: (n_z,) half widths of the box [rad or m].

        Returns:
            (bodies, hulls) maximum displacement [m] of each hull from its position at the center of
            the box. Row k ignores the motion of all joints up to and including the joint of body k.
        """
        T = self.skeleton.poses_from_configuration(z)
        points, joints = self._corners(T), self._joints
        at, axes = (T[self._moving] @ joints.lines)[..., :3, :].transpose(2, 0, 1)
        levers = np.linalg.norm(np.cross(points - at[:, None], axes[:, None]), axis=-1)
        steps = np.abs(joints.ratios) * w[joints.coordinates]
        turned = steps * joints.turns
        displacements = self._carried * (
            turned[:, None] * levers + (steps * joints.slides)[:, None]
        )
        # Row j of `beyond` contains the motion of each corner caused by joint j and the following
        # joints.
        beyond = np.zeros((len(steps) + 1, len(points)))
        beyond[:-1] = np.cumsum(displacements[::-1], axis=0)[::-1]
        most = np.maximum.reduceat(beyond, self._starts, axis=1)
        found = np.zeros((len(self.skeleton.bodies), len(self.hulls)))
        found[0], found[self._moving] = most[0], most[1:]
        return found

    def common(self, i: int, j: int) -> int:
        """Return the index of the last moving body that carries hulls i and j.

        If no moving body carries both hulls, the index is 0, which is the ground.
        """
        bodies = [*self.hulls[i].bodies, *self.hulls[j].bodies]
        shared = set.intersection(*(set(self._chain(int(k))) for k in bodies))
        return max(shared & {0, *self._moving.tolist()})

    def _chain(self, k: int) -> list[int]:
        chain = [k]
        while (parent := self.skeleton.bodies[chain[-1]].parent) is not None:
            chain.append(parent)
        return [*chain, 0]

    def _corners(self, T: FloatArray) -> FloatArray:
        own = T[..., self._carriers, :3, :]
        return np.asarray((own[..., :3] @ self._local[:, :, None])[..., 0] + own[..., 3])

    @cached_property
    def _ends(self) -> IntArray:
        return np.asarray(np.cumsum([len(hull.corners) for hull in self.hulls]))

    @cached_property
    def _starts(self) -> IntArray:
        return np.asarray(np.concatenate([[0], self._ends[:-1]]))

    @cached_property
    def _carriers(self) -> IntArray:
        return np.concatenate([hull.bodies for hull in self.hulls])

    @cached_property
    def _local(self) -> FloatArray:
        return np.concatenate([hull.corners for hull in self.hulls])

    @cached_property
    def _first(self) -> IntArray:
        return np.array([hull.bodies[0] for hull in self.hulls])

    @cached_property
    def _struts(self) -> IntArray:
        return np.flatnonzero([hull.is_strut for hull in self.hulls])

    @cached_property
    def _strut_corners(self) -> IntArray:
        return np.asarray(self._starts[self._struts] + np.array([[0], [1]]))

    @cached_property
    def _placements(self) -> FloatArray:
        """(hulls, 4, 4) poses of the shapes on their bodies.

        The pose of a plate is the identity.
        """
        made = np.tile(np.eye(4), (len(self.hulls), 1, 1))
        for k, hull in enumerate(self.hulls):
            if len(hull.corners) <= 2 and not hull.is_strut:  # noqa: PLR2004 - a line has two ends
                made[k] = capsules_along(hull.corners[:1], hull.corners[-1:])[1][0]
        return made

    @cached_property
    def _moving(self) -> IntArray:
        bodies = enumerate(self.skeleton.bodies)
        return np.array([k for k, body in bodies if body.joint and body.joint.kind != "fixed"])

    @cached_property
    def _carried(self) -> NDArray[np.bool_]:
        """(joints, corners) mask, True where a joint moves a corner of a collision shape."""
        chains = [set(self._chain(int(k))) for k in self._carriers]
        return np.array([[int(k) in chain for chain in chains] for k in self._moving])

    @cached_property
    def _joints(self) -> _MovingJoints:
        return _MovingJoints([self.skeleton.bodies[k] for k in self._moving])


class _MovingJoints:
    """Arrays that describe the moving joints of bodies."""

    def __init__(self, bodies: list[Body]) -> None:
        joints = [body.joint for body in bodies if body.joint]
        self.coordinates = np.array([joint.coordinate for joint in joints])
        self.ratios = np.array([joint.ratio for joint in joints])
        self.turns = np.array([float(joint.kind != "prismatic") for joint in joints])
        self.slides = np.array(
            [1.0 if joint.kind == "prismatic" else abs(joint.advance) for joint in joints]
        )
        # The two columns of each joint contain a point of the axis and the direction of the axis,
        # in homogeneous coordinates.
        self.lines = np.array([[[*j.at, 1.0], [*j.axis, 0.0]] for j in joints]).transpose(0, 2, 1)


def hulls_of(robot: Robot) -> Hulls:
    """Return the shapes of a robot's bodies.

    Args:
        robot: The robot.

    Raises:
        ManifestError: The robot was derived by an earlier version of chasles and must be derived
            again.
    """
    bones = skeleton(robot)
    made = []
    ground = bones.bodies[0].name
    joints_on_ground = sum(ground in names for names in joined(bones))
    for k, body in enumerate(bones.bodies):
        if body.span is not None:
            if not body.span.from_end:
                made.append(
                    Hull(body.span.name, np.array(body.span.bodies), np.array(body.span.ends))
                )
            continue
        for shape in body.shapes:
            stands_for_ground = k == 0 and joints_on_ground > 1 and shape.kind in ("link", "plate")
            points = np.array(shape.points)
            pieces: list[FloatArray] = []
            if shape.kind in _LINES:
                pieces = [np.array(pair) for pair in pairwise(points)]
            elif shape.kind in ("plate", "carriage"):
                pieces = [points]
            if not stands_for_ground:
                made += [Hull(body.name, np.full(len(piece), k), piece) for piece in pieces]
    return Hulls(robot, bones, tuple(made))


def joined(bones: Skeleton) -> list[set[str]]:
    """Return the names of the two bodies or struts that each joint connects.

    Bodies fixed to each other share the name of the first body. The first body has the shapes of
    all bodies fixed to it.
    """
    names: list[str] = []
    for body in bones.bodies:
        is_fixed = body.joint is not None and body.joint.kind == "fixed"
        names.append(names[body.parent] if is_fixed and body.parent is not None else body.name)
    found = []
    for k, body in enumerate(bones.bodies):
        if body.joint and body.joint.kind != "fixed" and body.parent is not None:
            found.append({names[k], names[body.parent]})
        elif body.span and not body.span.from_end:
            found += [{body.span.name, names[carrier]} for carrier in body.span.bodies]
    return found + [{names[k] for k in closure.bodies} for closure in bones.closures]


def _rounded(corners: FloatArray, radius: float) -> Any:
    """Return the rounded hull of corners (m, 3) as a shape of the library coal."""
    with requires("chasles[planning]"):
        import coal  # noqa: PLC0415

    points, faces = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    for corner in corners:
        points.append(corner)
    # The library coal searches for the farthest corner of a shape along its edges. This search is
    # exact if all edges of the shape are listed.
    for face in combinations(range(len(corners)), 3):
        faces.append(coal.Triangle(*face))
    made = coal.Convex(points, faces)
    made.setSweptSphereRadius(radius)
    return made
