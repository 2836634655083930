"""Computes body poses and loop closure errors of a mechanism in NumPy.

The module computes poses and errors only from the robot description, so they verify derived
functions independently. All functions of this module accept arrays of configurations, with complex
values for complex-step derivatives.
"""

from functools import cache

import numpy as np

from chasles.derive import Rotation, read
from chasles.derive.model.mechanism import Strut
from tests.support.derivations import description

TINY = 1e-30
"""Step size of complex-step derivatives, which are accurate up to rounding errors."""
ROUNDING = 1e-13
"""Newton step size [rad or m] at which the iteration ends, because only rounding errors remain."""


class Model:
    """A numeric mechanism.

    A configuration z (N, n_z) contains all moving joints in the order of the description, and then
    the strut coordinates. A strut coordinate is a cylinder length or the swing angle of a strut on
    pins.
    """

    def __init__(self, mechanism):
        self.mechanism = mechanism
        self.given = {p.symbol: p.value for p in mechanism.parameters}
        self.base, self.tool = self._pose(mechanism.base), self._pose(mechanism.tool)
        self._around = {
            joint.name: (self._pose(joint.before), self._pose(joint.after))
            for joint in mechanism.joints
        }
        self._places = {
            c.name: (self._pose(c.a.placement), self._pose(c.b.placement))
            for c in mechanism.loop_joints
        }
        self.names = [joint.name for joint in mechanism.joints if joint.kind != "fixed"]
        for strut in mechanism.struts:
            self.names += [strut.name] * strut.is_cylinder
            self.names += [strut.swing_name] * (strut.ends == "pin")
        self.ratio = np.array([self._float(c.ratio) for c in mechanism.coordinates])
        self.actuated = [self.names.index(c.moves) for c in mechanism.coordinates]
        self.unknown = [k for k in range(len(self.names)) if k not in self.actuated]
        self.chain = self.places_of(joint.name for joint in mechanism.main_chain.moving)
        self.passive = self.places_of(mechanism.passive)
        self._axes = {strut.name: self._swing_axes(strut) for strut in mechanism.struts}

    def places_of(self, names):
        """Return the indices of named joints in the configuration z."""
        return [self.names.index(name) for name in names]

    def poses(self, z):
        """Return the pose (N, 4, 4) of every body in the base frame."""
        T = {self.mechanism.base_frame: np.broadcast_to(self.base, (len(z), 4, 4))}
        for joint in self.mechanism.joints:
            before, after = self._around[joint.name]
            moved = T[joint.parent] @ before
            if joint.kind != "fixed":
                value = joint.direction * z[:, self.names.index(joint.name)]
                moved = _moved(moved, joint.kind, value)
            T[joint.link] = moved if np.array_equal(after, np.eye(4)) else moved @ after
        return T

    def tip(self, z):
        """Return the tool pose (N, 4, 4) at each configuration."""
        return self.poses(z)[self.mechanism.tool_body] @ self.tool

    def gaps(self, z):
        """Return the loop closure errors (N, m): lengths in meter, and sines of angles."""
        T = self.poses(z)
        found = [np.zeros((len(z), 0))]
        for loop_joint in self.mechanism.loop_joints:
            A, B = self._places[loop_joint.name]
            body = T[loop_joint.a.body]
            A, B = body @ A, T[loop_joint.b.body] @ B
            if isinstance(loop_joint, Strut):
                found.append(self._strut_gap(loop_joint, z, body, B[:, :3, 3] - A[:, :3, 3]))
            else:
                found.append(_closure_gap(loop_joint.kind, A, B))
        return np.concatenate(found, axis=1)

    def gap(self, z):
        """Return the largest loop closure error (N,) of each configuration."""
        return np.abs(self.gaps(z)).max(-1, initial=0.0)

    def D_z(self, z):
        """Return the derivative (N, m, n_z) of the closure errors with respect to z."""
        moved = z[:, None] + TINY * 1j * np.eye(len(self.names))
        rates = self.gaps(moved.reshape(-1, len(self.names))).imag / TINY
        return rates.reshape(*z.shape, rates.shape[-1]).swapaxes(1, 2)

    def newton(self, z, known):
        """Return configurations near z at which the loops close. The variables ``known`` keep
        their values.

        Iterates until the Newton step is as small as the rounding error.
        """
        z = z.copy()
        free = [k for k in range(len(self.names)) if k not in known]
        rows = np.arange(len(z))
        for _ in range(30):
            if not rows.size:
                break
            part = z[rows]
            inverse = np.linalg.pinv(self.D_z(part)[..., free])
            step = (inverse @ self.gaps(part)[..., None])[..., 0]
            z[np.ix_(rows, free)] -= step
            rows = rows[np.abs(step).max(-1, initial=0.0) > ROUNDING]
        return z

    def tangent(self, z, known):
        """Return the derivative (N, n_z, known) of z with respect to its entries ``known``."""
        free = [k for k in range(len(self.names)) if k not in known]
        J = self.D_z(z)
        found = np.zeros((*z.shape, len(known)))
        found[:, known] = np.eye(len(known))
        found[:, free] = -np.linalg.pinv(J[..., free]) @ J[..., known]
        return found

    def z_D_q(self, z):
        """Return the derivative (N, n_z, n) of z with respect to the actuated coordinates."""
        return self.tangent(z, self.actuated) * self.ratio

    def _strut_gap(self, strut, z, body, d):
        length = np.full(len(z), self._float(strut.length))
        if strut.is_cylinder:
            length = length + z[:, self.names.index(strut.name)]
        if strut.ends == "ball":
            return (((d**2).sum(-1) - length**2) / (2 * length.real))[:, None]
        swing = z[:, self.names.index(strut.swing_name)]
        x, y = (body[:, :3, :3] @ axis for axis in self._axes[strut.name])
        along = np.cos(swing)[:, None] * x + np.sin(swing)[:, None] * y
        return d - along * length[:, None]

    def _swing_axes(self, strut):
        """Return the directions of a strut at swing angles of 0 and 90 degrees.

        At 0 degrees, the strut points along the first start-body axis (x, y or z) perpendicular to
        the loop's first revolute axis. At 90 degrees, the strut points along the cross product of
        the loop's first revolute axis and the 0-degree direction.
        """
        if strut.ends == "ball":
            return None
        T = self.poses(np.zeros((1, len(self.names))))
        a, b = (self.mechanism.path_to(frame.body) for frame in (strut.a, strut.b))
        own = [joint for joint in (*a, *b) if (joint in a) != (joint in b)]
        order = [joint for joint in self.mechanism.joints if joint in own]
        turning = next((joint for joint in order if joint.kind == "revolute"), None)
        if turning is None:
            raise NotImplementedError("a loop without revolute joints is not supported")
        axis = (T[turning.parent][0] @ self._around[turning.name][0])[:3, 2] * turning.direction
        n = T[strut.a.body][0, :3, :3].T @ axis
        x = next(e for e in np.eye(3) if abs(n @ e) < 1e-9)
        return x, np.cross(n, x)

    def _pose(self, placement):
        T = np.eye(4)
        for motion in placement:
            step = np.eye(4)
            if isinstance(motion, Rotation):
                j, k = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[motion.axis]
                angle = self._float(motion.angle)
                step[j, j] = step[k, k] = np.cos(angle)
                step[k, j] = np.sin(angle)
                step[j, k] = -step[k, j]
            else:
                step[:3, 3] = [self._float(c) for c in motion.vector]
            T = T @ step
        return T

    def _float(self, expression):
        return float(expression.xreplace(self.given))


def _moved(T, kind, value):
    """Translate or rotate poses (N, 4, 4) by values (N,) along or about their own z axes."""
    moved, (x, y, z) = T.astype(np.result_type(T, value)), np.moveaxis(T[..., :3], -1, 0)
    if kind == "prismatic":
        moved[..., 3] += z * value[:, None]
    else:
        c, s = np.cos(value)[:, None], np.sin(value)[:, None]
        moved[..., 0], moved[..., 1] = c * x + s * y, c * y - s * x
    return moved


def _closure_gap(kind, A, B):
    R = np.swapaxes(A[:, :3, :3], -1, -2)
    turn, d = R @ B[:, :3, :3], (R @ (B[:, :3, 3] - A[:, :3, 3])[..., None])[..., 0]
    turned = [turn[:, 1, 2], turn[:, 0, 2], turn[:, 0, 1]]
    rows = {
        "pin": [d[:, 0], d[:, 1], d[:, 2], *turned[:2]],
        "slider": [d[:, 0], d[:, 1], *turned],
        "ball": [d[:, 0], d[:, 1], d[:, 2]],
        "weld": [d[:, 0], d[:, 1], d[:, 2], *turned],
    }[kind]
    return np.stack(rows, -1)


@cache
def model(name):
    return Model(read(description(name)))


def wrapped(angle):
    """Reduce angles to the range from -pi to pi."""
    return np.angle(np.exp(1j * angle))
