"""Gravity torques of a chain with point masses, and their derivatives.

Joint k has the screw (v_k; omega_k) in the base frame. Joint k carries the mass M_k, whose first
moment about the base origin is c_k. The torque tau_k of joint k is the scalar product of the
gravity vector g and a moment vector w_k:

    w_k = M_k v_k + omega_k x c_k, tau_k = g . w_k.

The derivative of the torque tau_k with respect to the value of a later joint j is (g x omega_k) .
w_j. The matrix of all torque derivatives is symmetric, because gravity torques have a potential.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import sympy as sp

from ..model.errors import DescriptionError
from ..model.robot import Joint, Load, SerialRobot
from ..terms.terms import Terms
from ..terms.vectors import Vector, added, combination, cross, dot, named
from .differential import columns
from .forward import Forward
from .groups import groups
from .poe import placement_matrix


@dataclass(frozen=True)
class GravityTorques:
    """Torques that gravity exerts on the joint coordinates.

    Attributes:
        values: The torque on each revolute coordinate (N m), and the force on each prismatic
            coordinate (N).
        D_q: Derivatives of the torques with respect to the coordinates, one row per torque.
    """

    values: tuple[sp.Expr, ...]
    D_q: tuple[tuple[sp.Expr, ...], ...]


def gravity_torques(
    robot: SerialRobot, load: Load, terms: Terms, q: Sequence[sp.Symbol]
) -> GravityTorques:
    """Return the gravity torques of a robot's load at coordinates q.

    Args:
        robot: The robot.
        load: The masses and the gravity vector.
        terms: Receives the terms.
        q: Symbols of the coordinates.
    """
    forward = Forward(terms, groups(robot, terms, robot.joint_values(q)))
    screws = columns(forward, "space")
    gravity = named(terms, load.gravity)
    works = [
        added(
            terms,
            combination(terms, [mass], [screw.v]),
            cross(terms, screw.omega, moment),
        )
        for screw, (mass, moment) in zip(screws, _beyond(robot, load, forward), strict=True)
    ]
    torques = [dot(terms, gravity, work) for work in works]
    turned = [cross(terms, gravity, screw.omega) for screw in screws]
    count = range(len(screws))
    derivatives = sp.Matrix(
        [[dot(terms, turned[min(j, k)], works[max(j, k)]) for j in count] for k in count]
    )
    # A coupled joint exerts its torque on all coordinates that move the joint.
    by_q = robot.joint_values_D_q()
    of_q = by_q.T * sp.Matrix(torques)
    D_q = by_q.T * derivatives * by_q
    return GravityTorques(
        tuple(terms.let(torque) for torque in of_q),
        tuple(tuple(terms.let(entry) for entry in row) for row in D_q.tolist()),
    )


def most_stiffness(robot: SerialRobot, load: Load) -> list[float]:
    """Return a bound of sum_j |d tau_k / d q_j| for the gravity torque tau_k of each joint k.

    Args:
        robot: A chain of revolute and prismatic joints, whose link frames coincide with the base
            frame if all coordinates are 0.
        load: One mass per link, with the gravity vector.

    Returns:
        One upper bound of the torque derivatives for each joint (N m/rad or N/m).

    Raises:
        DescriptionError: A prismatic joint on which the bound depends has no limits.
    """
    gravity = float(sp.sqrt(sum(g**2 for g in load.gravity)))
    work = []
    for k, joint in enumerate(robot.joints):
        masses = [float(point.mass) for point in load.masses[k:]]
        turns = joint.kind == "revolute"
        reach = _reaches(robot, load, k) if turns else [1.0 for _ in masses]
        work.append(float(np.dot(masses, reach)))
    count = range(len(work))
    return [gravity * sum(work[max(j, k)] for j in count) for k in count]


def _reaches(robot: SerialRobot, load: Load, first: int) -> list[float]:
    reaches, distance = [], 0.0
    at = np.zeros(3)
    for k, joint in enumerate(robot.joints[first:], first):
        if joint.kind == "prismatic":
            distance += _stroke(joint)
        else:
            place = np.array(placement_matrix(joint.before)[:3, 3], dtype=float).ravel()
            distance += float(np.linalg.norm(place - at)) if k > first else 0.0
            at = place
        center = np.array([float(x) for x in load.masses[k].at])
        reaches.append(distance + float(np.linalg.norm(center - at)))
    return reaches


def _stroke(joint: Joint) -> float:
    low, high = joint.limits
    if low is None or high is None:
        raise DescriptionError(f"prismatic joint {joint.name!r}: a spring requires joint limits")
    return max(abs(float(low)), abs(float(high)))


def _beyond(robot: SerialRobot, load: Load, forward: Forward) -> list[tuple[sp.Expr, Vector]]:
    """Return (mass, first moment about the base origin) of the load beyond each moving joint."""
    terms = forward.terms
    placed = {
        name: (axes, origin)
        for name, (axes, origin) in zip(robot.link_names, forward.link_poses(), strict=True)
    }
    found: list[tuple[sp.Expr, Vector]] = []
    mass: sp.Expr = sp.S.Zero
    moment: Vector = (sp.S.Zero,) * 3
    for name, joint in reversed(list(zip(robot.link_names, robot.joints, strict=True))):
        axes, origin = placed[name]
        for point in load.masses:
            if point.link == name:
                weight = terms.let(point.mass)
                position = added(terms, origin, combination(terms, named(terms, point.at), axes))
                moment = added(terms, moment, combination(terms, [weight], [position]))
                mass = terms.let(mass + weight)
        if joint.kind != "fixed":
            found.append((mass, moment))
    return found[::-1]
