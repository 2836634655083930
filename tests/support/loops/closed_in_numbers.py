"""Closes kinematic loops of robots numerically, without the loop equations that chasles derives."""

import numpy as np

from chasles.derive import Rotation
from chasles.derive.model.mechanism import Strut

# Loops are closed up to rounding error. The result must be within NEAR (radian or meter) of the
# reference in the description.
CLOSED = 1e-12
NEAR = 0.15
# Minimum singular value of a well-conditioned loop Jacobian.
HELD = 0.02


def pose(placement, values):
    T = np.eye(4)
    for motion in placement:
        step = np.eye(4)
        if isinstance(motion, Rotation):
            j, k = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[motion.axis]
            angle = float(motion.angle.xreplace(values))
            step[j, j] = step[k, k] = np.cos(angle)
            step[k, j] = np.sin(angle)
            step[j, k] = -step[k, j]
        else:
            step[:3, 3] = [float(c.xreplace(values)) for c in motion.vector]
        T = T @ step
    return T


def moved(joint, value):
    T = np.eye(4)
    if joint.kind == "prismatic":
        T[2, 3] = value
    elif joint.kind == "revolute":
        c, s = np.cos(value), np.sin(value)
        T[:2, :2] = [[c, -s], [s, c]]
    return T


class Model:
    """A mechanism with numeric dimensions.

    The actuated coordinates are q, and the other joints and cylinders have the values u.
    """

    def __init__(self, mechanism):
        values = {p.symbol: p.value for p in mechanism.parameters}
        self.mechanism = mechanism
        self.base, self.tool = pose(mechanism.base, values), pose(mechanism.tool, values)
        self.around = {
            joint.name: (pose(joint.before, values), pose(joint.after, values))
            for joint in mechanism.joints
        }
        self.places = {
            c.name: (pose(c.a.placement, values), pose(c.b.placement, values))
            for c in mechanism.loop_joints
        }
        self.length = {s.name: float(s.length.xreplace(values)) for s in mechanism.struts}
        self.moves = {
            c.moves: (k, float(c.ratio.xreplace(values)))
            for k, c in enumerate(mechanism.coordinates)
        }
        moving = [joint.name for joint in mechanism.joints if joint.kind != "fixed"]
        cylinders = [strut.name for strut in mechanism.struts if strut.is_cylinder]
        self.unknown = [name for name in (*moving, *cylinders) if name not in self.moves]
        # The reference configuration contains the value of either a motor or the joint that this
        # motor moves.
        stated = dict(mechanism.reference)
        self.q = np.array(
            [
                float(stated[c.name] if c.name in stated else mechanism.reference_of(moved) / ratio)
                for c, (moved, (_, ratio)) in zip(
                    mechanism.coordinates, self.moves.items(), strict=True
                )
            ]
        )
        self.u = np.array([float(mechanism.reference_of(name)) for name in self.unknown])

    def values(self, q, u):
        driven = {name: q[k] * ratio for name, (k, ratio) in self.moves.items()}
        return driven | dict(zip(self.unknown, u, strict=True))

    def poses(self, q, u):
        values = self.values(q, u)
        T = {self.mechanism.base_frame: self.base}
        for joint in self.mechanism.joints:
            before, after = self.around[joint.name]
            motion = moved(joint, joint.direction * values.get(joint.name, 0.0))
            T[joint.link] = T[joint.parent] @ before @ motion @ after
        return T

    def tip(self, q, u):
        return self.poses(q, u)[self.mechanism.tool_body] @ self.tool

    def ends(self, loop_joint, q, u):
        T = self.poses(q, u)
        A, B = self.places[loop_joint.name]
        return T[loop_joint.a.body], T[loop_joint.a.body] @ A, T[loop_joint.b.body] @ B

    def residual(self, q, u):
        values, parts = self.values(q, u), [np.zeros(0)]
        for coupling in self.mechanism.couplings:
            follows = sum(float(ratio) * values[name] for name, ratio in coupling.ratios)
            parts.append([values[coupling.joint] - follows - float(coupling.offset)])
        for loop_joint in self.mechanism.loop_joints:
            _, A, B = self.ends(loop_joint, q, u)
            if isinstance(loop_joint, Strut):
                length = self.length[loop_joint.name] + self.values(q, u).get(loop_joint.name, 0.0)
                parts.append([np.linalg.norm(B[:3, 3] - A[:3, 3]) - length])
            else:
                apart = np.linalg.inv(A) @ B
                parts.append([*apart[:3, 3], *apart[: {"pin": 2, "ball": 0}[loop_joint.kind], 2]])
        return np.concatenate(parts)

    def jacobian(self, q, u, step=1e-6):
        columns = [
            (self.residual(q, u + step * e) - self.residual(q, u - step * e)) / (2 * step)
            for e in np.eye(len(u))
        ]
        return np.array(columns).reshape(len(u), -1).T

    def closed(self, q, u):
        """Return the values of the unknown joints, near u, at which all loops close."""
        for _ in range(30):
            r = self.residual(q, u)
            if np.abs(r).max(initial=0.0) < CLOSED:
                return u
            du = np.linalg.lstsq(self.jacobian(q, u), -r, rcond=None)[0]
            u = u + du * min(1.0, 0.3 / np.abs(du).max())
        raise AssertionError(f"{self.mechanism.name}: the loops do not close at {q}")

    def held(self, q, u):
        """Return the smallest singular value of the loop Jacobian, which is 0 at a dead point."""
        return np.linalg.svd(self.jacobian(q, u), compute_uv=False)[len(u) - 1] if len(u) else 1.0

    def followed(self, q, steps=12):
        """Follow the reference branch from the reference configuration to the coordinates q.

        Returns the values of the unknown joints at q, and the smallest singular value of the loop
        Jacobian over all steps.
        """
        u, held = self.closed(self.q, self.u), np.inf
        for part in np.linspace(0, 1, steps + 1):
            at = self.q + part * (np.asarray(q) - self.q)
            u = self.closed(at, u)
            held = min(held, self.held(at, u))
        return u, held
