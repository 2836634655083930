"""Errors of poses and inverse solutions, compared with arithmetic in extended precision."""

import numpy as np

import chasles
from chasles.derive import SerialRobot, read
from tests.support.derivations import description
from tests.support.oracles.extended_precision import extended_fk
from tests.support.oracles.screws import screws
from tests.support.peers.case_answers import MAX_JOINTS
from tests.support.peers.interface import gathered, inverses

from ..cases.arms import PANDA, UR5E
from ..peers.forward import setups
from ..report import Limit, Plan

ARMS = ("ur5e", "puma560", "irb6640", "panda")
FORWARD = {arm.name: arm for arm in (UR5E, PANDA)}
"""Robot arms for which forward kinematics is compared with Pinocchio, keyed by name."""
POSES = 10_000
PEERS_POSES = 1_000
"""Number of targets for other libraries, which take milliseconds per target."""
FK_BAR, IK_BAR = 1e-13, 5e-14
"""The limits that the tests of the generated code check."""
UNIT = "m or rad"


def run(plan: Plan) -> list[Limit]:
    """Return the largest errors of fk and ik at random poses [m or rad].

    An error is the larger of the distance between two poses [m] and the chord 2 sin(angle/2) of the
    rotation between them [rad].
    """
    found = []
    for name in ARMS:
        arm, robot = chasles.load(name), read(description(name))
        q = np.random.default_rng(0).uniform(-np.pi, np.pi, (min(plan.batch, POSES), arm.n))
        found += of_poses(arm, robot, q)
        if arm.n <= MAX_JOINTS:
            found += of_solutions(arm, robot, arm.fk(q))
    return found


def errors(T: np.ndarray, exact: np.ndarray) -> np.ndarray:
    """Return the errors (...) of poses T (..., 4, 4)."""
    difference = T - exact
    distance = np.linalg.norm(difference[..., :3, 3].astype(float), axis=-1)
    chord = np.linalg.norm(difference[..., :3, :3].astype(float), axis=(-2, -1)) / np.sqrt(2)
    return np.maximum(distance, chord)


def of_poses(arm: chasles.Robot, robot: SerialRobot, q: np.ndarray) -> list[Limit]:
    """Return the largest errors of fk in chasles and in Pinocchio."""
    exact = extended_fk(robot, q)
    rows = [_row(f"{arm.name} fk", errors(arm.fk(q), exact), FK_BAR)]
    if arm.name not in FORWARD:
        return rows
    for peer in setups("calls", FORWARD[arm.name], only=("pinocchio",)):
        poses = np.array([peer.read(peer.fk(row))[0].copy() for row in q[:PEERS_POSES]])
        rows.append(_row(f"{arm.name} fk, {peer.name}", errors(poses, exact[:PEERS_POSES])))
    return rows


def of_solutions(arm: chasles.Robot, robot: SerialRobot, T: np.ndarray) -> list[Limit]:
    """Return the largest errors of all inverse solutions in chasles and in other libraries."""
    found, some = arm.ik(T), T[:PEERS_POSES]
    rows = [_row(f"{arm.name} ik", _reached(robot, T, found.q, found.valid), IK_BAR)]
    for peer in inverses(screws(arm.name)):
        answers = gathered(map(peer.found, some), arm.n)
        reached = _reached(robot, some, answers.q, answers.claimed)
        rows.append(_row(f"{arm.name} ik, {peer.name}", reached))
    return rows


def _reached(robot: SerialRobot, T: np.ndarray, q: np.ndarray, valid: np.ndarray) -> np.ndarray:
    pose, _ = np.nonzero(valid)
    return errors(extended_fk(robot, q[valid]), T[pose])


def _row(key: str, found: np.ndarray, bar: float | None = None) -> Limit:
    return Limit(f"{key}: largest error", float(found.max()), UNIT, bar)
