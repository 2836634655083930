"""The torques of gravity on the coordinates of a chain with point masses, and their derivatives.

With M_k the mass beyond joint k, c_k its first moment about the base's origin, and (v_k; omega_k)
the joint's screw in the base frame, the weight does work against the joint by

    w_k = M_k v_k + omega_k x c_k,    tau_k = g . w_k,

and the derivative of tau_k by a joint j beyond it is (g x omega_k) . w_j, which is symmetric in k
and j since the torques have a potential.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import sympy as sp

from ..model.errors import RobotError
from ..model.robot import Joint, Load, SerialRobot
from ..terms.terms import Terms
from ..terms.vectors import Vector, added, combination, cross, dot, named
from .differential import columns
from .forward import Forward
from .groups import groups
from .poe import placement_matrix


@dataclass(frozen=True)
class GravityTorques:
    """The torques of gravity on the coordinates.

    Attributes:
        values: The torque on each coordinate (N m), or the force (N).
        D_q: Their derivatives by the coordinates, a row a torque.
    """

    values: tuple[sp.Expr, ...]
    D_q: tuple[tuple[sp.Expr, ...], ...]


def gravity_torques(
    robot: SerialRobot, load: Load, terms: Terms, q: Sequence[sp.Symbol]
) -> GravityTorques:
    """The torques of a robot's load at coordinates q.

    Args:
        robot: The robot.
        load: Its masses and gravity.
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
    # Joints that mimic a leader act on its coordinate.
    by_q = robot.joint_values_D_q()
    of_q = by_q.T * sp.Matrix(torques)
    D_q = by_q.T * derivatives * by_q
    return GravityTorques(
        tuple(terms.let(torque) for torque in of_q),
        tuple(tuple(terms.let(entry) for entry in row) for row in D_q.tolist()),
    )


def most_stiffness(robot: SerialRobot, load: Load) -> list[float]:
    """Bounds of sum_j |d tau_k / d q_j| at all coordinates within the limits of slides.

    Args:
        robot: A chain whose joints turn or slide, each link's frame the base frame at zero.
        load: Its masses, one for each link, and gravity.

    Returns:
        A bound for each joint k (N m/rad, N/m), by the length of the chain stretched out.

    Raises:
        RobotError: A slide has no limits.
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
    """The largest distance of each further link's mass from a turning joint."""
    reaches, way = [], 0.0
    at = np.zeros(3)
    for k, joint in enumerate(robot.joints[first:], first):
        if joint.kind == "prismatic":
            way += _stroke(joint)
        else:
            place = np.array(placement_matrix(joint.before)[:3, 3], dtype=float).ravel()
            way += float(np.linalg.norm(place - at)) if k > first else 0.0
            at = place
        centre = np.array([float(x) for x in load.masses[k].at])
        reaches.append(way + float(np.linalg.norm(centre - at)))
    return reaches


def _stroke(joint: Joint) -> float:
    low, high = joint.limits
    if low is None or high is None:
        raise RobotError(f"slide {joint.name!r} has no limits, which springs need")
    return max(abs(float(low)), abs(float(high)))


def _beyond(robot: SerialRobot, load: Load, forward: Forward) -> list[tuple[sp.Expr, Vector]]:
    """The mass beyond each moving joint and its first moment about the base's origin."""
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
