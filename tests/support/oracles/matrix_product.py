"""Compares an arm with coupled joints (theta = C q + c) with the same arm without couplings."""

from dataclasses import dataclass

import casadi as ca
import numpy as np

from chasles.derive import Derivation, derive
from chasles.derive.terms.casadi_graph import lower
from tests.support.generators.coupled_arms import CoupledArm
from tests.support.generators.synthetic import Function

FUNCTIONS = (
    *("fk", "fk_jacobian_mixed", "jacobian_space", "jacobian_body", "jacobian_mixed_dot"),
    *("hessian_mixed", "twist_body", "acceleration_space"),
)
MAPS = ("chain", "actuators")
"""Names of the functions that only coupled arms have."""
VALID = 1e-9
SAME = 1e-7


@dataclass(frozen=True)
class ProductErrors:
    """Largest errors of a coupled arm's functions, and the number of missing IK solutions.

    Attributes:
        pose: Largest pose error.
        jacobian: Largest error of Jacobians, relative to the largest entry.
        rate: Largest error of derivatives of the Jacobian, twists and accelerations, relative to
            the largest entry.
        maps: Largest error of ``chain`` and ``actuators``.
        lost: Number of inverse solutions that are missing in the coupled arm.
        solutions: Number of inverse solutions of the arm without couplings.
    """

    pose: float
    jacobian: float
    rate: float
    maps: float
    lost: int
    solutions: int


def product_errors(arm: CoupledArm, poses: int, rng: np.random.Generator) -> ProductErrors:
    """Compare a coupled arm with the same arm without couplings at random configurations."""
    coupled, plain = derive(arm.robot), derive(arm.plain)
    mine, its = _kernels(coupled, (*FUNCTIONS, *MAPS)), _kernels(plain, FUNCTIONS)
    pose = jacobian = rate = maps = 0.0
    n = len(arm.c)
    C = arm.C
    for _ in range(poses):
        theta, thetad, thetadd = rng.uniform(-3, 3, (3, n))
        q, qd, qdd = (np.linalg.solve(C, x) for x in (theta - arm.c, thetad, thetadd))
        theta, thetad, thetadd = C @ q + arm.c, C @ qd, C @ qdd
        pose = max(pose, np.abs(_at(mine["fk"], q) - _at(its["fk"], theta)).max())
        for name in ("jacobian_space", "jacobian_body"):
            J = _at(its[name], theta).reshape(6, n) @ C
            jacobian = max(jacobian, _off(_at(mine[name], q).reshape(6, n), J))
        Jd = _at(its["jacobian_mixed_dot"], theta, thetad).reshape(6, n) @ C
        rate = max(rate, _off(_at(mine["jacobian_mixed_dot"], q, qd).reshape(6, n), Jd))
        H = _at(its["hessian_mixed"], theta).reshape(6, n, n)
        H = np.einsum("ijk,jl,km->ilm", H, C, C)
        rate = max(rate, _off(_at(mine["hessian_mixed"], q).reshape(6, n, n), H))
        V = _at(its["twist_body"], theta, thetad)
        rate = max(rate, _off(_at(mine["twist_body"], q, qd), V))
        A = _at(its["acceleration_space"], theta, thetad, thetadd)
        rate = max(rate, _off(_at(mine["acceleration_space"], q, qd, qdd), A))
        maps = max(maps, _off(_at(mine["chain"], q), theta), _off(_at(mine["actuators"], theta), q))
    lost, solutions = (0, 0)
    if "ik" in plain.inverse.functions:
        lost, solutions = _lost(arm, coupled, plain, rng, poses)
    return ProductErrors(pose, jacobian, rate, maps, lost, solutions)


def _lost(
    arm: CoupledArm,
    coupled: Derivation,
    plain: Derivation,
    rng: np.random.Generator,
    poses: int,
) -> tuple[int, int]:
    lost = solutions = 0
    (fk,) = lower([plain.function("fk")], "arm")
    mine, its = (Function(derived.inverse.functions["ik"]) for derived in (coupled, plain))
    extra = [argument.size for argument in its.inputs[1:]]
    for _ in range(poses):
        T = _at(fk, rng.uniform(-3, 3, len(arm.c))).reshape(4, 4)
        given = rng.uniform(-1, 1, sum(extra))
        found, wanted = (ik(T[None], *given[:, None]) for ik in (mine, its))
        for k in np.flatnonzero(wanted.valid[0]):
            solutions += 1
            q = np.linalg.solve(arm.C, wanted.q[0, k] - arm.c)
            scale = max(1.0, np.abs(q).max())
            near = np.abs(found.q[0] - q).max(-1) <= SAME * scale
            lost += not (near & found.valid[0]).any()
    return lost, solutions


def _kernels(derived: Derivation, names: tuple[str, ...]) -> dict[str, ca.Function]:
    functions = [derived.function(name) for name in names]
    return dict(zip(names, lower(functions, "arm"), strict=True))


def _at(kernel: ca.Function, *inputs: np.ndarray) -> np.ndarray:
    return np.array(kernel(*inputs)).ravel()


def _off(found: np.ndarray, wanted: np.ndarray) -> float:
    return float(np.abs(found - wanted).max() / max(1.0, np.abs(wanted).max()))
