"""Poses of serial robots in more than double precision, from the robot description alone."""

import mpmath
import numpy as np
import sympy as sp

from chasles.derive import Rotation, SerialRobot

DIGITS = 30


def motion(rotation_or_translation, values):
    if isinstance(rotation_or_translation, Rotation):
        angle = number(rotation_or_translation.angle, values)
        return turn(rotation_or_translation.axis, angle)
    T = mpmath.eye(4)
    for row, component in enumerate(rotation_or_translation.vector):
        T[row, 3] = number(component, values)
    return T


def turn(axis, angle):
    T = mpmath.eye(4)
    j, k = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    T[j, j] = T[k, k] = mpmath.cos(angle)
    T[k, j] = mpmath.sin(angle)
    T[j, k] = -T[k, j]
    return T


def number(expression, values):
    return from_sympy(sp.sympify(expression).xreplace(values))


def from_sympy(expression):
    return mpmath.mpf(sp.Float(expression.evalf(DIGITS), DIGITS)._mpf_)


def poses_by_matrices(robot, q):
    """Return link and tool poses as products of elementary matrices."""
    values = {parameter.symbol: parameter.value for parameter in robot.parameters}
    positions = iter(robot.joint_values([sp.Float(value, DIGITS) for value in q]))
    T = mpmath.eye(4)
    poses = []

    def place(placement):
        nonlocal T
        for part in placement:
            T = T * motion(part, values)

    place(robot.base)
    for joint in robot.joints:
        place(joint.before)
        if joint.kind != "fixed":
            value = next(positions)
            if joint.kind != "prismatic":
                T = T * turn("z", number(value, values))
            slide = value if joint.kind == "prismatic" else joint.pitch * value
            T[:3, 3] += number(slide, values) * T[:3, 2]
        place(joint.after)
        poses.append(T.copy())
    place(robot.tool)
    return poses, T


def extended_fk(robot: SerialRobot, q: np.ndarray) -> np.ndarray:
    """Return tool poses (m, 4, 4) at q (m, n) in extended precision (np.longdouble).

    All moving joints must be revolute. Each constant transform of the robot is computed with 30
    digits, and then rounded to np.longdouble.
    """
    values = {parameter.symbol: parameter.value for parameter in robot.parameters}
    angles = iter(np.asarray(q, np.longdouble).T)
    T = np.eye(4, dtype=np.longdouble)
    with mpmath.workdps(DIGITS):
        T = T @ _placement(robot.base, values)
        for joint in robot.joints:
            T = T @ _placement(joint.before, values)
            if joint.kind != "fixed":
                assert (joint.kind, joint.direction) == ("revolute", 1)
                T = T @ _about_z(next(angles))
            T = T @ _placement(joint.after, values)
        return T @ _placement(robot.tool, values)


def _placement(placement, values) -> np.ndarray:
    T = mpmath.eye(4)
    for part in placement:
        T = T * motion(part, values)
    return rounded(T)


def rounded(T: mpmath.matrix) -> np.ndarray:
    """Return an mpmath matrix as an array, rounded to np.longdouble."""
    return np.array(
        [[np.longdouble(mpmath.nstr(entry, DIGITS)) for entry in row] for row in T.tolist()]
    )


def _about_z(angle: np.ndarray) -> np.ndarray:
    T = np.zeros((*angle.shape, 4, 4), np.longdouble)
    T[..., 0, 0] = T[..., 1, 1] = np.cos(angle)
    T[..., 1, 0] = np.sin(angle)
    T[..., 0, 1] = -T[..., 1, 0]
    T[..., 2, 2] = T[..., 3, 3] = 1
    return T
