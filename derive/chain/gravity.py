"""The torques of gravity on the coordinates of a chain with point masses, and their derivatives.

With M_k the mass beyond joint k, c_k its first moment about the base's origin, and (v_k; omega_k)
the joint's screw in the base frame, the weight does work against the joint by

    w_k = M_k v_k + omega_k x c_k,    tau_k = g . w_k,

and the derivative of tau_k by a joint j beyond it is (g x omega_k) . w_j, which is symmetric in k
and j since the torques have a potential.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import sympy as sp

from ..model.robot import Load, Robot
from ..terms.terms import Terms
from ..terms.vectors import Vector, added, combination, cross, dot, named
from .differential import columns
from .forward import Forward
from .groups import groups


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
    robot: Robot, load: Load, terms: Terms, q: Sequence[sp.Symbol]
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


def _beyond(robot: Robot, load: Load, forward: Forward) -> list[tuple[sp.Expr, Vector]]:
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
