"""Random serial arms whose joints are coupled to motors by an invertible rational matrix."""

import random
from dataclasses import dataclass, replace

import numpy as np
import sympy as sp

from chasles.derive import Coupling, Motor, SerialRobot
from tests.support.generators.drawn_arms import random_arm
from tests.support.generators.synthetic import robot_of

RATIOS = tuple(sp.Rational(*pq) for pq in ((1, 1), (-1, 1), (1, 2), (-3, 2), (2, 1), (1, 80)))
OFFSETS = (sp.S.Zero, sp.Rational(1, 5), sp.Rational(-3, 10))
STRUCTURES = (
    *("R=R", "R+R", "R+R=R", "R=R=R", "P+R=R", "R=R=PxR", "R+R=R=R", "R+R=R=R+R"),
    *("R+R=R/RxrxR", "R+R=R=R+R+R", "R+P=R/RxrxR", "R/R=R/RxrxR", "RxrxR+RxrxRxR"),
)
"""Axis structures of arms with closed-form inverse kinematics. Half of the generated arms have one
of the listed axis structures."""
DENSITY = 0.4
"""Probability that an off-diagonal entry of the coupling matrix C is nonzero."""
MAX_JOINTS, MAX_CONDITION = 7, 200.0


@dataclass(frozen=True)
class CoupledArm:
    """An arm whose motor coordinates q determine the joint values theta = C q + c.

    Attributes:
        robot: The coupled arm.
        plain: The arm without couplings, whose coordinates are the joint values theta.
        C: (n, n) matrix of the coupling ratios between joints and motors.
        c: The offsets (n,).
    """

    robot: SerialRobot
    plain: SerialRobot
    C: np.ndarray
    c: np.ndarray


def coupled_arm(seed: int) -> CoupledArm:
    """Return the random arm for a seed, with two to seven joints."""
    draw = random.Random(seed)
    plain = random_arm(seed) if seed % 2 else robot_of(draw.choice(STRUCTURES), seed=seed)
    while len(plain.moving) > MAX_JOINTS:
        plain = random_arm(draw.randrange(10**6))
    n = len(plain.moving)
    while True:
        C = sp.Matrix(n, n, lambda i, j: _ratio(draw, is_own=i == j))
        if C.rank() == n and np.linalg.cond(np.array(C, dtype=float)) < MAX_CONDITION:
            break
    offsets = [draw.choice(OFFSETS) for _ in range(n)]
    return with_motors(plain, C, offsets)


def with_motors(plain: SerialRobot, C: sp.Matrix, offsets: list[sp.Expr]) -> CoupledArm:
    """Return an arm whose motor coordinates q determine the joint values C q + offsets."""
    n = len(plain.moving)
    names = [f"m{k}" for k in range(1, n + 1)]
    couplings = tuple(
        Coupling(joint.name, tuple(zip(names, C.row(k), strict=True)), offsets[k])
        for k, joint in enumerate(plain.moving)
    )
    robot = replace(plain, couplings=couplings, motors=tuple(map(Motor, names)))
    order = [names.index(name) for name in robot.linear_map.coordinates]
    matrix = np.array(C, dtype=float)[:, order]
    return CoupledArm(robot, plain, matrix, np.array(offsets, dtype=float))


def _ratio(draw: random.Random, *, is_own: bool) -> sp.Expr:
    return draw.choice(RATIOS) if is_own or draw.random() < DENSITY else sp.S.Zero
