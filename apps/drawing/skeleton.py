"""Rigid bodies of a robot and their poses, for drawings and viewers."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chasles import ManifestError, Robot
from chasles.contract import Body, BodyJoint, ClosureFrames, Shape, SkeletonFacts, Span, check_type
from chasles.summaries import summary_repr

FloatArray = NDArray[np.float64]
_PART = 0.4
"""Position of the drawn coordinate in its range (0 to 1) if the reference is at a limit."""
__all__ = ["Body", "BodyJoint", "Shape", "Skeleton", "Span", "skeleton"]


def skeleton(robot: Robot) -> Skeleton:
    """Return the rigid bodies of a robot with their shapes, for drawings and viewers.

    Args:
        robot: The robot, from `chasles.load`.

    Raises:
        ManifestError: The robot was derived by an earlier version of chasles. Derive it again.
    """
    check_type("skeleton: robot", robot, Robot)
    facts: SkeletonFacts | None = robot.manifest.skeleton
    if facts is None:
        raise ManifestError(
            f"{robot.folder}: {robot.name}: the manifest has no skeleton; derive the robot again "
            "with this version"
        )
    actuators = {item.index: k for k, item in enumerate(robot.manifest.loops.actuated_in_z)}
    if not robot.configuration_variables:
        actuators = {k: k for k in range(robot.n)}
    q_drawn = np.array(facts.q_drawn) if facts.q_drawn else _between_limits(robot)
    tip = facts.tip.body, _pose(facts.tip.placement)
    return Skeleton(robot, facts.bodies, *tip, facts.size, q_drawn, facts.closures, actuators)


@dataclass(frozen=True, eq=False)
class Skeleton:
    """The rigid bodies of a robot, from `skeleton`.

    Attributes:
        robot: The robot.
        bodies: The ground, one body per joint, then rods and cylinder halves. The frame of the
            ground is the base frame. Parents precede children.
        tip: Index of the body that carries the tool frame.
        tip_placement: (4, 4) pose of the tool frame in the frame of this body [m].
        size: Diagonal of the robot's bounding box [m], at the reference configuration of a robot
            with loops, otherwise at q = 0.
        q_drawn: (n,) configuration that `draw` shows by default [rad or m].
        closures: The joints that close kinematic loops, not including rods and cylinders.
        actuators: Mapping from the index of an actuated coordinate in z to its index in q. z is
            the vector of `robot.configuration_variables`, or q for a serial robot.
    """

    robot: Robot
    bodies: tuple[Body, ...]
    tip: int
    tip_placement: FloatArray
    size: float
    q_drawn: FloatArray
    closures: tuple[ClosureFrames, ...]
    actuators: dict[int, int] = field(repr=False)

    def __repr__(self) -> str:
        """Return a short summary with the names of the bodies."""
        names = ", ".join(body.name for body in self.bodies)
        return summary_repr(
            self, self.robot.name, f"{len(self.bodies)} bodies: {names}", methods="poses(q)"
        )

    def poses(self, q: ArrayLike, z_seed: ArrayLike | None = None) -> FloatArray:
        """Return the pose of every body in the base frame.

        Args:
            q: (..., n) actuated coordinates [rad or m].
            z_seed: (..., n_z) nearby configurations of a robot whose loops are solved by iteration,
                in the order of `robot.configuration_variables`. They select the branch. The default
                is the branch of the reference configuration.

        Returns:
            (..., bodies, 4, 4) body poses. `poses(q)[..., tip, :, :] @ tip_placement` equals
            `robot.fk(q)`. In a batch, the poses are NaN where loops do not close.

        Raises:
            OutOfReachError: q is a single configuration (n,) at which loops do not close.
        """
        if not self.robot.configuration_variables:
            return self.poses_from_configuration(q)
        if z_seed is None:
            return self.poses_from_configuration(self.robot.configuration(q))
        return self.poses_from_configuration(self.robot.configuration_near(q, z_seed))

    def poses_from_configuration(self, z: ArrayLike) -> FloatArray:
        """Return the pose of every body in the base frame at configurations z.

        Args:
            z: (..., n_z) configurations in the order of `robot.configuration_variables`
                [rad or m]. For a serial robot, z is q.

        Returns:
            (..., bodies, 4, 4) body poses. z does not need to close the loops. If a loop is open,
            each rod or cylinder still points from its first end point to its second.
        """
        local = self._motions.poses(np.asarray(z, dtype=np.float64))
        found = np.empty((*local.shape[:-3], len(self.bodies), 4, 4))
        found[..., 0, :, :] = np.eye(4)
        for k, parent in enumerate(self._motions.parents, 1):
            np.matmul(found[..., parent, :, :], local[..., k - 1, :, :], out=found[..., k, :, :])
        if self._spans is not None:
            found[..., len(self._motions.parents) + 1 :, :, :] = self._spans.poses(found)
        return found

    def tip_poses(self, poses: FloatArray) -> FloatArray:
        """Return the tool poses (..., 4, 4) that belong to body poses (..., bodies, 4, 4)."""
        tips: FloatArray = poses[..., self.tip, :, :] @ self.tip_placement
        return tips

    def actuator(self, joint: BodyJoint | None) -> int | None:
        """Return the index in q of the coordinate of an actuated joint, or None if passive."""
        k = None if joint is None else self.actuators.get(joint.coordinate)
        is_serial = not self.robot.configuration_variables
        if joint is None or k is None or not is_serial:
            return k
        # A mimic joint moves with the coordinate of another joint.
        return k if self.robot.coordinates[k].name == joint.name else None

    @cached_property
    def _motions(self) -> _Motions:
        return _Motions([body for body in self.bodies if body.joint])

    @cached_property
    def _spans(self) -> _Spans | None:
        spans = [body.span for body in self.bodies if body.span]
        return _Spans(spans) if spans else None


def _between_limits(robot: Robot) -> FloatArray:
    """Return the reference coordinates, away from the limits if possible."""
    assert robot.reference is not None
    q = np.array(robot.reference.q)
    with np.errstate(invalid="ignore"):
        at_limit = np.isfinite(robot.upper - robot.lower) & (
            (q <= robot.lower) | (q >= robot.upper)
        )
        middle = np.where(at_limit, robot.lower + _PART * (robot.upper - robot.lower), q)
    # For an open loop, `configuration` returns NaN for a batch, but raises for one configuration.
    closes = bool(np.isfinite(robot.configuration(middle[None])).all())
    return middle if closes else q


class _Motions:
    """Body poses for joint values v: each local pose is P + sin v A + (1 - cos v) B + v C."""

    def __init__(self, bodies: list[Body]) -> None:
        self.parents = [body.parent for body in bodies]
        joints = [body.joint for body in bodies if body.joint]
        self.coordinates = np.array([max(joint.coordinate, 0) for joint in joints])
        moves = np.array([joint.kind != "fixed" for joint in joints])
        self.ratios = np.where(moves, [joint.ratio for joint in joints], 0.0)
        self.offsets = np.array([joint.offset for joint in joints])
        P = np.array([_pose(body.placement) for body in bodies])
        A, B, C = (np.zeros((len(bodies), 4, 4)) for _ in range(3))
        for k, joint in enumerate(joints):
            axis, at = np.array(joint.axis), np.array(joint.at)
            C[k, :3, 3] = axis * (1.0 if joint.kind == "prismatic" else joint.advance)
            if joint.kind in ("revolute", "helical"):
                K = np.cross(np.eye(3), axis)
                A[k, :3, :3], A[k, :3, 3] = K, -K @ at
                B[k, :3, :3], B[k, :3, 3] = K @ K, -K @ K @ at
        self.terms = np.array([P, P @ A, P @ B, P @ C]).reshape(4, len(bodies), 16)

    def poses(self, z: FloatArray) -> FloatArray:
        v = z[..., self.coordinates] * self.ratios + self.offsets
        weights = np.stack([np.ones_like(v), np.sin(v), 1 - np.cos(v), v], axis=-1)
        flat = np.einsum("...kt,tkm->...km", weights, self.terms)
        return np.asarray(flat.reshape(*v.shape, 4, 4))


class _Spans:
    """The struts of the robot as arrays."""

    def __init__(self, spans: list[Span]) -> None:
        self.a, self.b = np.array([span.bodies for span in spans]).T
        ends = np.array([span.ends for span in spans])
        self.at_a, self.at_b = ends[:, 0, :, None], ends[:, 1, :, None]
        self.across = np.array([span.across for span in spans])[:, :, None]
        self.from_end = np.array([span.from_end for span in spans])[:, None]

    def poses(self, bodies: FloatArray) -> FloatArray:
        A, B = bodies[..., self.a, :, :], bodies[..., self.b, :, :]
        a = (A[..., :3, :3] @ self.at_a)[..., 0] + A[..., :3, 3]
        b = (B[..., :3, :3] @ self.at_b)[..., 0] + B[..., :3, 3]
        z = _unit(b - a)
        across = (A[..., :3, :3] @ self.across)[..., 0]
        y = _unit(across - z * (across * z).sum(-1, keepdims=True))
        T = np.zeros((*z.shape[:-1], 4, 4))
        T[..., :3, 0], T[..., :3, 1], T[..., :3, 2] = np.cross(y, z), y, z
        T[..., :3, 3] = np.where(self.from_end, b, a)
        T[..., 3, 3] = 1.0
        return T


def _unit(v: FloatArray) -> FloatArray:
    found: FloatArray = v / np.sqrt((v * v).sum(-1, keepdims=True))
    return found


def _pose(rows: Any) -> FloatArray:
    return np.array([*rows, (0.0, 0.0, 0.0, 1.0)])
