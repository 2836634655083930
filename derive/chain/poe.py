"""Product of exponentials: exact screw axes and home pose of any robot."""

from functools import lru_cache

import sympy as sp

from chasles.contract import check_type

from ..model.robot import Placement, Rotation, SerialRobot
from ..model.values import shortened

PLACEMENTS = 1024
"""Maximum number of placements whose matrices are cached."""


def product_of_exponentials(
    description: SerialRobot,
) -> tuple[sp.ImmutableMatrix, sp.ImmutableMatrix]:
    """Return the screw axes and the home pose of a serial robot in any convention.

    ``T_0_ee(q) = exp(S_1 theta_1) ... exp(S_n theta_n) M_0_ee``, where theta are the values of the
    n moving joints. If no joint is coupled or reversed, theta equals the coordinates q. Otherwise,
    ``description.joint_values(q)`` returns theta.

    Args:
        description: A serial robot, for example from ``read``.

    Returns:
        ``S_space`` (6, n) and ``M_0_ee`` (4, 4), in meters. Each column of ``S_space`` is a screw
        axis (v, omega) in the base frame. ``M_0_ee`` is the pose of the tool frame in the base
        frame at theta = 0. The entries may contain the symbols of the robot's parameters.

    Source:
        Brockett 1984; Lynch and Park, Modern Robotics, 4.1.
    """
    check_type("product_of_exponentials: description", description, SerialRobot)
    T_0_joint = placement_matrix(description.base)
    screws = []
    for joint in description.joints:
        T_0_joint = T_0_joint * placement_matrix(joint.before)
        if joint.kind != "fixed":
            direction, point = T_0_joint[:3, 2], T_0_joint[:3, 3]
            if joint.kind == "prismatic":
                screws.append(sp.Matrix.vstack(direction, sp.zeros(3, 1)))
            else:
                v = point.cross(direction) + joint.pitch * direction
                screws.append(sp.Matrix.vstack(v, direction))
        T_0_joint = T_0_joint * placement_matrix(joint.after)
    M_0_ee = T_0_joint * placement_matrix(description.tool)
    return sp.ImmutableMatrix(sp.Matrix.hstack(*screws)), sp.ImmutableMatrix(M_0_ee)


def placement_matrix(placement: Placement) -> sp.Matrix:
    """Return the homogeneous matrix (4, 4) of a constant placement."""
    return _matrix_of(placement).copy()


@lru_cache(maxsize=PLACEMENTS)
def _matrix_of(placement: Placement) -> sp.Matrix:
    T = sp.eye(4)
    for k, motion in enumerate(placement):
        step = _turn(motion) if isinstance(motion, Rotation) else _shift(motion.vector)
        T = (T * step if k else step).applyfunc(shortened)
    return T


def _turn(rotation: Rotation) -> sp.Matrix:
    c, s = sp.cos(rotation.angle), sp.sin(rotation.angle)
    j, k = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[rotation.axis]
    T = sp.eye(4)
    T[j, j], T[j, k], T[k, j], T[k, k] = c, -s, s, c
    return T


def _shift(vector: tuple[sp.Expr, sp.Expr, sp.Expr]) -> sp.Matrix:
    T = sp.eye(4)
    T[:3, 3] = sp.Matrix(vector)
    return T
