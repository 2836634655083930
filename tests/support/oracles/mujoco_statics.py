"""Static loads of a mechanism from MuJoCo's inverse dynamics at rest.

In the MuJoCo model, every body, rod, barrel and piston of the robot is a MuJoCo body. The MuJoCo
model is built at one configuration of the robot, at which all model coordinates are 0. Loops are
cut at the second end of each strut and at each closure. The forces at the cuts of the loops and the
actuator forces follow from MuJoCo's gravity forces and Jacobians. The joint loads are MuJoCo's
internal forces.
"""

from typing import NamedTuple

import numpy as np
import pytest

from chasles.drawing import skeleton
from chasles.drawing.skeleton import Body
from chasles.study import PointMass

mujoco = pytest.importorskip("mujoco", reason="the oracle of static loads")

MASSLESS = 1e-12
"""Mass (kilogram) of a massless body in MuJoCo, which refuses a mass of 0."""
KINDS = {"revolute": "hinge", "prismatic": "slide"}
PIN = np.eye(6)[[0, 1, 2, 3, 4]]
PLANAR_PIN = np.eye(6)[[0, 1]]
"""Force and moment components that a pin about z transmits, in the frame of the pin."""


class Loads(NamedTuple):
    """Static loads as in `chasles.study.statics.StaticLoads`, with the equilibrium residual."""

    actuators: np.ndarray
    joints: np.ndarray
    struts: np.ndarray
    residual: float


def text(values):
    return " ".join(repr(float(value)) for value in np.ravel(values))


def element(name, pose, joint, masses, children):
    """Return the MJCF text of a body with its point masses."""
    total = sum(m.mass for m in masses)
    center = sum((m.mass * np.array(m.at) for m in masses), np.zeros(3)) / max(total, MASSLESS)
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, np.ascontiguousarray(pose[:3, :3]).ravel())
    return (
        f'<body name="{name}" pos="{text(pose[:3, 3])}" quat="{text(quat)}">{joint}'
        f'<inertial pos="{text(center)}" mass="{max(total, MASSLESS)!r}" '
        f'diaginertia="{text([MASSLESS] * 3)}"/>{children}</body>'
    )


class Model:
    """The MuJoCo model of a robot at one configuration."""

    def __init__(self, robot, q, masses, gravity):
        self.robot, self.skeleton = robot, skeleton(robot)
        self.bodies = self.skeleton.bodies
        self.poses = self.skeleton.poses(q)
        self.masses = masses
        g = f'<option gravity="{text(gravity)}"/><compiler balanceinertia="true"/>'
        xml = f"<mujoco>{g}<worldbody>{self.children(0)}</worldbody></mujoco>"
        self.model = mujoco.MjModel.from_xml_string(xml)
        self.data = mujoco.MjData(self.model)
        mujoco.mj_inverse(self.model, self.data)
        self.weights = -self.data.qfrc_inverse.copy()

    def children(self, parent):
        """Return the MJCF text of all bodies that a parent body carries."""
        found = ""
        for k, body in enumerate(self.bodies):
            if body.joint and body.parent == parent:
                found += self.element(k, body, parent, self.joint(body), self.children(k))
            elif body.span and not body.span.from_end and body.span.bodies[0] == parent:
                ball = f'<joint name="{body.name}" type="ball"/>'
                piston = [i for i in range(k + 1, len(self.bodies)) if self.is_piston(i, body)]
                slide = f'<joint name="{body.span.name}" type="slide" axis="0 0 1"/>'
                inner = "".join(self.element(i, self.bodies[i], k, slide, "") for i in piston)
                found += self.element(k, body, parent, ball, inner)
        return found

    def is_piston(self, k, barrel):
        span = self.bodies[k].span
        return span.from_end and span.name == barrel.span.name

    def element(self, k, body: Body, parent, joint, children):
        pose = np.linalg.inv(self.poses[parent]) @ self.poses[k]
        masses = [m for m in self.masses if m.link == body.name]
        return element(body.name, pose, joint, masses, children)

    @staticmethod
    def joint(body):
        if body.joint.kind == "fixed":
            return ""
        axis, at = text(body.joint.axis), text(body.joint.at)
        kind = KINDS[body.joint.kind]
        return f'<joint name="{body.joint.name}" type="{kind}" axis="{axis}" pos="{at}"/>'

    def jacobian(self, body, point):
        """Return the Jacobians (3, nv) of a body point's position and of the body's rotation."""
        J, R = np.zeros((3, self.model.nv)), np.zeros((3, self.model.nv))
        k = self.model.body(body).id if body else 0
        mujoco.mj_jac(self.model, self.data, J, R, np.asarray(point, dtype=float), k)
        return J, R

    def cuts(self):
        """Yield (body, other body, point, unit wrenches (k, 6)) for each cut of a loop."""
        for k, body in enumerate(self.bodies):
            span = body.span
            if span and (span.from_end or not self.has_piston(span.name)):
                b, at = span.bodies[1], np.array(span.ends[1])
                yield k, b, self.poses[b][:3, :3] @ at + self.poses[b][:3, 3], np.eye(6)[:3]
        for closure in self.skeleton.closures:
            (a, b), frame = closure.bodies, np.array(closure.frames[1])
            R = self.poses[b][:3, :3] @ frame[:, :3]
            at = self.poses[b][:3, :3] @ frame[:, 3] + self.poses[b][:3, 3]
            unit = PLANAR_PIN if self.is_planar() else PIN
            assert closure.kind == "pin"
            yield a, b, at, unit @ np.kron(np.eye(2), R.T)

    def is_planar(self):
        """Test whether the axes of all revolute joints are parallel."""
        turning = [k for k, b in enumerate(self.bodies) if b.joint and b.joint.kind == "revolute"]
        axes = [self.poses[k][:3, :3] @ self.bodies[k].joint.axis for k in turning]
        return np.linalg.matrix_rank(axes, tol=1e-9) == 1

    def has_piston(self, name):
        return any(b.span and b.span.name == name and b.span.from_end for b in self.bodies)

    def name(self, k):
        return self.bodies[k].name if k else ""

    def actuated(self):
        """Yield (joint name, joint motion per unit of q) for each actuator."""
        variables = self.robot.configuration_variables
        facts = self.robot.manifest.loops.actuated_in_z
        joints = {b.joint.coordinate: b.joint for b in self.bodies if b.joint}
        if not variables:
            yield from ((joints[k].name, joints[k].ratio) for k in range(self.robot.n))
        for item in facts:
            joint = joints.get(item.index)
            name = joint.name if joint else variables[item.index].name
            yield name, item.ratio * (joint.ratio if joint else 1.0)

    def loads(self, wrench) -> Loads:
        """Return the loads of all joints, struts and actuators."""
        tip = self.skeleton.tip_poses(self.poses[None])[0, :3, 3]
        tool = self.name(self.skeleton.tip)
        J, R = self.jacobian(tool, tip)
        applied = self.weights + J.T @ wrench[:3] + R.T @ wrench[3:]
        cuts = list(self.cuts())
        columns = []
        for a, b, at, units in cuts:
            ends = [np.concatenate(self.jacobian(self.name(k), at)) for k in (a, b)]
            columns += list(units @ (ends[1] - ends[0]))
        actuated = list(self.actuated())
        for name, ratio in actuated:
            unit = np.zeros(self.model.nv)
            unit[self.model.joint(name).dofadr[0]] = 1 / ratio
            columns.append(unit)
        found, *_ = np.linalg.lstsq(np.array(columns).T, -applied, rcond=1e-10)
        residual = np.abs(np.array(columns).T @ found + applied).max()
        self.apply(tool, wrench[:3], wrench[3:], tip)
        forces = iter(found)
        struts = {}
        for a, b, at, units in cuts:
            force, moment = np.split(sum(next(forces) * row for row in units), 2)
            self.apply(self.name(a), -force, -moment, at)
            self.apply(self.name(b), force, moment, at)
            if self.bodies[a].span:
                struts[self.bodies[a].span.name] = self.axial(a, force)
        actuators = found[len(found) - len(actuated) :]
        for (name, _), force in zip(actuated, actuators, strict=True):
            if name in struts:
                struts[name] = force
        order = dict.fromkeys(b.span.name for b in self.bodies if b.span)
        return Loads(
            actuators, self.internal(), np.array([struts[name] for name in order]), residual
        )

    def axial(self, body, force):
        """Return the mean axial force of a rod, or 0 for a passive cylinder."""
        if self.bodies[body].span.from_end:
            return 0.0
        u = self.poses[body][:3, 2]
        weight = sum(m.mass for m in self.masses if m.link == self.name(body))
        return force @ u - weight * (self.model.opt.gravity @ u) / 2

    def apply(self, body, force, torque, at):
        if body:
            k = self.model.body(body).id
            arm = at - self.data.xipos[k]
            self.data.xfrc_applied[k] += np.concatenate([force, np.cross(arm, force) + torque])

    def internal(self):
        """Return the wrench of each joint at the origin of the joint frame."""
        self.data.qacc[:] = 0
        mujoco.mj_rnePostConstraint(self.model, self.data)
        found = []
        for k, body in enumerate(self.bodies):
            if body.joint:
                index = self.model.body(body.name).id
                moment, force = np.split(self.data.cfrc_int[index], 2)
                about = self.data.subtree_com[self.model.body_rootid[index]]
                at = self.poses[k][:3, :3] @ body.joint.at + self.poses[k][:3, 3]
                found.append(np.concatenate([force, moment + np.cross(about - at, force)]))
        return np.array(found)


def mujoco_loads(robot, q, masses, wrench, gravity) -> Loads:
    """Return the static loads of a robot at rest from MuJoCo.

    Args:
        robot: A robot with revolute, prismatic and fixed joints, without couplings.
        q: One configuration.
        masses: The masses.
        wrench: Force and torque on the tool at the tip, in base axes.
        gravity: Gravitational acceleration in the base frame.
    """
    return Model(robot, q, masses, gravity).loads(np.asarray(wrench))


def random_masses(robot, rng):
    """Return a random point mass on every body.

    The point mass of a strut lies on the axis of the strut.
    """
    bodies = skeleton(robot)
    found = []
    for body in bodies.bodies[1:]:
        at = rng.uniform(-0.3, 0.3, 3) * bodies.size
        if body.span:
            at[:2] = 0
        found.append(PointMass(body.name, float(rng.uniform(1, 20)), tuple(at)))
    return found
