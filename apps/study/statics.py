"""Computes the actuator forces of a robot at rest and the loads on joints, struts and closures.

    masses = [PointMass("boom", 1600, [2.6, 0, 0.4]), PointMass("bucket", 900, [0.6, 0, 0.3])]
    loads = static_loads(excavator, q, masses)
    loads.actuator_forces, loads.struts["bucket_link"], loads.joints["boom"]

The bodies of the robot are rigid, and its joints have no friction.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chasles import InputValueError, Robot, ShapeError
from chasles.contract import check_type
from chasles.summaries import summary_repr

from ..drawing.skeleton import Skeleton, skeleton
from .arguments import finite, real
from .equilibrium import Equilibrium, PointMass
from .results import StudyResult
from .tolerances import STATICALLY_SINGULAR

FloatArray = NDArray[np.float64]
_PRESTRESSED = 1e-6
"""A strut counts as free of internal force if its squared force is at most 1e-6 for all internal
forces of norm 1. Internal forces are in equilibrium without an external load.

If the squared internal force of a strut is larger than 1e-6, equilibrium does not determine the
strut force."""


@dataclass(frozen=True, eq=False)
class StaticLoads(StudyResult):
    """Forces and moments in a robot at rest.

    Attributes:
        robot: The robot's name.
        q: (..., n) actuated coordinates [rad or m].
        actuator_forces: (..., n) forces [N] and torques [N m] that hold the robot, positive in the
            direction of the coordinate.
        joint_names: (m,) names of the joints, without the joints that close a kinematic loop.
        joint_wrenches: (..., m, 6) force and moment [N, N m] from each joint on the link that it
            moves, in the axes of the base frame. The moment is about the origin of the joint frame.
            The component along the joint axis is the force or torque of the joint's actuator.
        strut_names: Names of the struts, which are rods and cylinders.
        strut_forces: (..., s) axial forces [N], positive if the strut pushes its ends apart. The
            force of a cylinder acts between barrel and piston. The force of a rod is the mean of
            the forces at its two ends.
        closure_names: Names of the closures, which are joints that close a kinematic loop between
            two links.
        closure_wrenches: (..., c, 6) force and moment [N, N m] that the first link of a closure
            exerts on the second link. The moment is about the origin of the closure frame on the
            second link. The forces and moments are in the axes of the base frame.
    """

    robot: str
    q: FloatArray
    actuator_forces: FloatArray
    joint_names: tuple[str, ...]
    joint_wrenches: FloatArray
    strut_names: tuple[str, ...]
    strut_forces: FloatArray
    closure_names: tuple[str, ...]
    closure_wrenches: FloatArray

    def __repr__(self) -> str:
        """Short summary with the main values."""
        return summary_repr(
            self,
            self.robot,
            f"{len(self.joint_names)} joints, {len(self.strut_names)} struts, "
            f"{len(self.closure_names)} closures",
            methods="joints[name], struts[name], closures[name], save(path)",
        )

    @property
    def joints(self) -> dict[str, FloatArray]:
        """(..., 6) force and moment [N, N m] of each joint, keyed by the name of the joint."""
        return dict(zip(self.joint_names, np.moveaxis(self.joint_wrenches, -2, 0), strict=True))

    @property
    def struts(self) -> dict[str, FloatArray]:
        """(...,) axial force [N] of each strut, keyed by the name of the strut."""
        return dict(zip(self.strut_names, np.moveaxis(self.strut_forces, -1, 0), strict=True))

    @property
    def closures(self) -> dict[str, FloatArray]:
        """(..., 6) force and moment [N, N m] of each closure, keyed by the name of the closure.

        A closure is a joint that closes a kinematic loop between two links.
        """
        by_name = np.moveaxis(self.closure_wrenches, -2, 0)
        return dict(zip(self.closure_names, by_name, strict=True))


def gravity_forces(
    robot: Robot,
    q: ArrayLike,
    masses: Sequence[PointMass] | None = None,
    *,
    gravity: ArrayLike | None = None,
) -> FloatArray:
    """Return the generalized forces of gravity on the actuated coordinates.

    A positive force acts in the positive direction of its coordinate. To hold the robot at rest,
    the actuators apply the negative of the returned forces.

    Args:
        robot: The robot.
        q: (..., n) actuated coordinates [rad or m].
        masses: `PointMass` objects. Each contains the name of a body, a mass [kg] and a center of
            mass in the frame of the body [m]. Bodies are links, and strut sections such as the
            barrel of a cylinder. None means the masses of the robot file.
        gravity: (3,) gravitational acceleration in the base frame [m/s^2]. None means the vector of
            the robot file, which is (0, 0, -9.81) by default.

    Returns:
        (..., n) torques [N m] of the revolute coordinates and forces [N] of the prismatic
        coordinates. If `q` contains several configurations, the forces are NaN at each
        configuration at which the loops do not close or the actuators cannot hold the robot. A NaN
        in `q` raises no error: the forces at this configuration are NaN.

    Raises:
        OutOfReachError: `q` is a single configuration (n,) at which the loops of the robot do not
            close.
        InputTypeError: `robot` is not a `Robot`, or an argument contains values that are not real
            numbers.
        ShapeError: `q` is not (..., n), `gravity` is not (3,), or a center of mass is not (3,).
        InputValueError: `masses` is None, and the robot file has no masses. A `PointMass` names an
            unknown body, or contains a negative or infinite mass. The center of mass of a strut
            section is not on the z axis of the section's frame. `gravity` contains a number that is
            not finite. `q` is a single configuration at which the actuators cannot hold the robot.
            The robot file couples a cylinder to another coordinate.
        ManifestError: An earlier version of chasles generated the robot's code. Derive the robot
            again.
    """
    check_type("gravity_forces: robot", robot, Robot)
    if masses is None and not robot.manifest.load.masses:
        raise InputValueError(
            f"{robot.name}.gravity_forces: the robot file has no [[masses]]; pass masses="
        )
    return -_Solved("gravity_forces", robot, q, masses, None, gravity).actuator_forces()


def static_loads(
    robot: Robot,
    q: ArrayLike,
    masses: Sequence[PointMass] | None = None,
    *,
    wrench: ArrayLike | None = None,
    gravity: ArrayLike | None = None,
) -> StaticLoads:
    """Return the forces and moments in all joints and struts of a robot at rest.

    Bodies are rigid, and joints have no friction. Struts are rods and cylinders. A closure is a
    joint that closes a kinematic loop. If all joint axes of a loop are parallel, its closure
    transmits no forces along the axes. In such a loop, the other joints carry the forces along the
    axes.

    Args:
        robot: The robot.
        q: (..., n) actuated coordinates [rad or m].
        masses: `PointMass` objects. Each contains the name of a body, a mass [kg] and a center of
            mass in the frame of the body [m]. Bodies are links, and strut sections such as the
            barrel of a cylinder. None means the masses of the robot file. If `masses` is None and
            the robot file has no masses, only `wrench` acts on the robot.
        wrench: (..., 6) external force [N] and moment [N m] on the tool, in the axes of the base
            frame. The moment is about the tool origin. None means no external force and moment.
        gravity: (3,) gravitational acceleration in the base frame [m/s^2]. None means the vector of
            the robot file, which is (0, 0, -9.81) by default.

    Returns:
        A `StaticLoads`. `actuator_forces` (..., n) contains the torques [N m] and forces [N] that
        hold the robot, positive in the direction of the coordinate. `joints`, `struts` and
        `closures` are dictionaries, keyed by the name of the joint, strut or closure. `joints`
        contains the force and moment (..., 6) [N, N m] that each joint exerts on the link that it
        moves, about the origin of the joint frame. `struts` contains axial forces (...,) [N],
        positive in compression. `closures` contains the force and moment (..., 6) [N, N m] that the
        first link of each closure exerts on the second link. All vectors are in the axes of the
        base frame. For several rows in `q` or `wrench`, the loads of a row are NaN if the loops do
        not close or equilibrium does not determine the loads. A NaN in `q` or `wrench` raises no
        error: the loads of this row are NaN.

    Raises:
        OutOfReachError: `q` is a single configuration (n,) at which the loops of the robot do not
            close.
        InputTypeError: `robot` is not a `Robot`, or an argument contains values that are not real
            numbers.
        ShapeError: `q` is not (..., n), `wrench` is not (..., 6), `gravity` is not (3,), or a
            center of mass is not (3,).
        ValueError: The leading dimensions of `q` and `wrench` cannot be broadcast together.
        InputValueError: A `PointMass` names an unknown body, or contains a negative or infinite
            mass. The center of mass of a strut section is not on the z axis of the section's frame.
            `gravity` contains a number that is not finite. The robot file couples a cylinder to
            another coordinate. `q` is a single configuration at which the actuators cannot hold the
            robot; the message names the coordinates that the load moves. The loads are statically
            indeterminate at all configurations of `q`; the message names the struts and closures.
        ManifestError: An earlier version of chasles generated the robot's code. Derive the robot
            again.
    """
    check_type("static_loads: robot", robot, Robot)
    found = _Solved("static_loads", robot, q, masses, wrench, gravity)
    found.refuse_prestress()
    return found.loads()


class _Solved:
    """The solved equilibrium equations of a batch of configurations."""

    def __init__(
        self,
        caller: str,
        robot: Robot,
        q: ArrayLike,
        masses: Sequence[PointMass] | None,
        wrench: ArrayLike | None,
        gravity: ArrayLike | None,
    ) -> None:
        load = robot.manifest.load
        masses = (
            [PointMass(m.link, m.mass, m.at) for m in load.masses] if masses is None else masses
        )
        self.robot, self.caller = robot, f"{robot.name}.{caller}"
        bodies = skeleton(robot)
        q = real(f"{caller}: q", q)
        w = real(f"{caller}: wrench", np.zeros(6) if wrench is None else wrench)
        if q.shape[-1:] != (robot.n,) or w.shape[-1:] != (6,):
            raise ShapeError(
                f"{self.caller}: expected q (..., {robot.n}) and wrench (..., 6), got shapes "
                f"{q.shape} and {w.shape}"
            )
        self.shape = np.broadcast_shapes(q.shape[:-1], w.shape[:-1])
        self.q = np.broadcast_to(q, (*self.shape, robot.n))
        poses = bodies.poses(self.q).reshape(-1, len(bodies.bodies), 4, 4)
        w = np.broadcast_to(w, (*self.shape, 6)).reshape(-1, 6)
        self.closed = np.asarray(np.isfinite(poses).all((1, 2, 3)) & np.isfinite(w).all(-1))
        self.equations = Equilibrium(robot, bodies, poses[self.closed])
        acceleration = load.gravity if gravity is None else gravity
        acceleration = finite(f"{caller}: gravity", acceleration, (3,))
        for mass in masses:
            _check_mass(caller, bodies, mass)
        self.applied = self.equations.weights(masses, acceleration)
        self.applied += self.equations.tool(w[self.closed])
        self._solve()

    def _solve(self) -> None:
        """Compute the unknown forces x from equilibrium at all coordinates without an actuator."""
        e = self.equations
        work = e.work(self.applied)
        G, rest = e.G / e.lengths[:, None], work / e.lengths
        allowed = STATICALLY_SINGULAR * np.abs(rest).max(-1, keepdims=True, initial=0.0)
        G, rest = G[:, e.free_rows], rest[:, e.free_rows]
        inverse = np.linalg.pinv(G, STATICALLY_SINGULAR)
        self.x = -(inverse @ rest[..., None])[..., 0]
        self.work = work + (e.G @ self.x[..., None])[..., 0]
        self.prestress = np.eye(G.shape[-1]) - inverse @ G
        moved = np.abs(rest + (G @ self.x[..., None])[..., 0]) > allowed
        self.solved = ~moved.any(-1)
        if len(moved) and not self.shape and moved.any():
            names = [e.coordinate_name(e.free_rows[k]) for k in np.flatnonzero(moved[0])]
            raise InputValueError(
                f"{self.caller}: not in equilibrium: no actuator can balance the load in this "
                f"configuration; the load moves {', '.join(names)}"
            )

    def refuse_prestress(self) -> None:
        """Raise an error if struts and closures can have internal forces without a load."""
        free = np.diagonal(self.prestress, axis1=-2, axis2=-1) > _PRESTRESSED
        self.solved &= ~free.any(-1)
        if len(free) and free.any(-1).all():
            names = dict.fromkeys(self.equations.unknowns[k] for k in np.flatnonzero(free[0]))
            raise InputValueError(
                f"{self.caller}: statically indeterminate: equilibrium does not determine the "
                f"loads; even without a load, forces are possible at {', '.join(names)}"
            )

    def actuator_forces(self) -> FloatArray:
        """Return the forces and torques (..., n) of the actuators."""
        e = self.equations
        columns = [
            ratio * (self.x[:, e.unknowns.index(at)] if isinstance(at, str) else -self.work[:, at])
            for at, ratio in e.driven
        ]
        return self._filled(np.stack(columns, -1))

    def loads(self) -> StaticLoads:
        """Return the forces and moments in all joints, struts and closures."""
        e = self.equations
        carried = e.carries @ (self.applied + e.wrenches(self.x))
        joints = {b.joint.name: (k, b.joint.at) for k, b in enumerate(e.skeleton.bodies) if b.joint}
        at_joints = [_moved_to(-carried[:, k], e.points(k, at)) for k, at in joints.values()]
        struts = np.zeros((len(self.x), len(e.struts)))
        for k, name in enumerate(e.struts):
            if name in e.unknowns:
                struts[:, k] = self.x[:, e.unknowns.index(name)]
        closures = np.zeros((len(self.x), len(e.skeleton.closures), 6))
        for k, closure in enumerate(e.skeleton.closures):
            b, point = closure.bodies[1], [row[3] for row in closure.frames[1]]
            own = self.x * [name == closure.name for name in e.unknowns]
            closures[:, k] = _moved_to(e.wrenches(own)[:, b], e.points(b, point))
        return StaticLoads(
            self.robot.name,
            self.q,
            self.actuator_forces(),
            tuple(joints),
            self._filled(np.stack(at_joints, 1)),
            tuple(e.struts),
            self._filled(struts),
            tuple(closure.name for closure in e.skeleton.closures),
            self._filled(closures),
        )

    def _filled(self, found: FloatArray) -> FloatArray:
        """Return results for all configurations, given results of the solved configurations.

        The results are NaN at configurations with open loops or without a solution for the loads.
        """
        values = np.full((len(self.closed), *found.shape[1:]), np.nan)
        values[np.flatnonzero(self.closed)[self.solved]] = found[self.solved]
        return values.reshape(*self.shape, *found.shape[1:])


def _check_mass(caller: str, bodies: Skeleton, mass: PointMass) -> None:
    """Raise an error if a mass has an unknown body, is negative, or is not on the strut axis."""
    names = [body.name for body in bodies.bodies]
    if mass.link not in names:
        raise InputValueError(
            f"{caller}: masses: unknown body {mass.link!r}; bodies of {bodies.robot.name}: "
            f"{', '.join(names)}"
        )
    at = finite(f"{caller}: masses: {mass.link}: at", mass.at, (3,))
    if not float(finite(f"{caller}: masses: {mass.link}: mass", mass.mass, ())) >= 0:
        raise InputValueError(
            f"{caller}: masses: {mass.link}: expected a mass of at least 0, got {mass.mass}"
        )
    if bodies.bodies[names.index(mass.link)].span and at[:2].any():
        raise InputValueError(
            f"{caller}: masses: {mass.link}: the mass of a strut section must be on its z axis, "
            f"got at = {tuple(map(float, at))}"
        )


def _moved_to(wrench: FloatArray, at: FloatArray) -> FloatArray:
    """Return wrenches (m, 6) about points (m, 3), given wrenches about the base origin."""
    force, moment = wrench[:, :3], wrench[:, 3:]
    return np.concatenate([force, moment - np.cross(at, force)], -1)
