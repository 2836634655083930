"""Errors of poses and inverse solutions, compared with arithmetic in extended precision."""

import numpy as np

import chasles
from chasles.derive import read
from tests.support.derivations import description
from tests.support.oracles.extended_precision import extended_fk
from tests.support.oracles.screws import screws
from tests.support.peers.interface import gathered, inverses

from ..cases.arms import PANDA, UR5E
from ..peers.forward import setups
from ..report import Limit, Plan

ARMS = ("ur5e", "puma560", "irb6640", "panda")
FORWARD = {arm.name: arm for arm in (UR5E, PANDA)}
"""Arms of the comparison with Pinocchio."""
POSES = 10_000
PEERS_POSES = 1_000
"""Number of targets for other libraries, which take milliseconds per target."""
FK_BAR, IK_BAR = 1e-13, 5e-14
"""The limits that the tests of the generated code check."""
UNIT = "m or rad"


def run(plan: Plan) -> list[Limit]:
    """Return the largest errors of fk and ik at random poses [m or rad].

    An error is the larger of the distance between two poses [m] and the chord 2 sin(angle/2) of
    their rotation [rad].
    """
    return [row for name in ARMS for row in (*of_poses(name, plan), *of_solutions(name, plan))]


def angles(name: str, count: int) -> np.ndarray:
    """Return random joint angles (count, n) [rad]."""
    return np.random.default_rng(0).uniform(-np.pi, np.pi, (count, chasles.load(name).n))


def errors(T: np.ndarray, exact: np.ndarray) -> np.ndarray:
    """Return the errors (...) of poses T (..., 4, 4)."""
    difference = T - exact
    distance = np.linalg.norm(difference[..., :3, 3].astype(float), axis=-1)
    chord = np.linalg.norm(difference[..., :3, :3].astype(float), axis=(-2, -1)) / np.sqrt(2)
    return np.maximum(distance, chord)


def of_poses(name: str, plan: Plan) -> list[Limit]:
    """Return the largest errors of fk in chasles and in Pinocchio."""
    robot, q = read(description(name)), angles(name, min(plan.batch, POSES))
    exact = extended_fk(robot, q)
    rows = [_row(f"{name} fk", errors(chasles.load(name).fk(q), exact), FK_BAR)]
    for peer in setups("calls", FORWARD[name], only=("pinocchio",)) if name in FORWARD else ():
        poses = np.array([peer.read(peer.fk(row))[0].copy() for row in q[:PEERS_POSES]])
        rows.append(_row(f"{name} fk, {peer.name}", errors(poses, exact[:PEERS_POSES])))
    return rows


def of_solutions(name: str, plan: Plan) -> list[Limit]:
    """Return the largest errors of all inverse solutions in chasles and in other libraries."""
    robot, arm = read(description(name)), chasles.load(name)
    q = angles(name, min(plan.batch, POSES))
    if arm.n > 6:
        return []
    T = arm.fk(q)
    found = arm.ik(T)
    rows = [_row(f"{name} ik", _reached(robot, T, found.q, found.valid), IK_BAR)]
    for peer in inverses(screws(name)):
        some = T[:PEERS_POSES]
        answers = gathered(map(peer.found, some), arm.n)
        worst = _reached(robot, some, answers.q, answers.claimed)
        rows.append(_row(f"{name} ik, {peer.name}", worst))
    return rows


def _reached(robot, T: np.ndarray, q: np.ndarray, valid: np.ndarray) -> np.ndarray:
    pose, _ = np.nonzero(valid)
    return errors(extended_fk(robot, q[valid]), T[pose])


def _row(key: str, found: np.ndarray, bar: float | None = None) -> Limit:
    return Limit(f"{key}: largest error", float(found.max()), UNIT, bar)
