"""Near fold points, the inverse of a calibrated arm returns exactly the true solutions.

Two solutions merge at a fold point.
"""

import numpy as np
import pytest

from chasles.derive import read
from tests.support.compiling import compiled
from tests.support.derivations import ROBOTS
from tests.support.generators.geometric_errors import displaced
from tests.support.oracles.pinocchio_fk import pinocchio_fk

ERROR = 3e-3
"""Calibration error (meter, radian) of the arm."""
ELBOW, WRIST = 2, 4
STARTS, STEPS = 150, 40
"""Numbers of start configurations per pose and of iterations per start in the independent numerical
search."""
TRUE = 1e-8
"""Maximum pose error (meter, or rotation matrix entry) of a correct inverse kinematics solution."""
KNOWN = 1e-4
"""The independent numerical search finds all solutions at which the smallest singular value of the
Jacobian exceeds 1e-4."""


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    """Return a calibrated arm and its forward kinematics from Pinocchio."""
    robot = displaced(read(ROBOTS / "ur5e.toml"), ERROR)
    folder = tmp_path_factory.mktemp("folds") / robot.name
    return compiled(robot, folder, ("fk", "fk_jacobian_mixed", "ik"), ["c"]), pinocchio_fk(robot)


def determinant(arm, q):
    return np.linalg.det(arm.fk_jacobian_mixed(q)[1])


def at_fold(arm, rng, count):
    """Return random configurations in which an elbow angle makes the Jacobian singular."""
    found = []
    while len(found) < count:
        q = np.tile(rng.uniform(-np.pi, np.pi, arm.n), (241, 1))
        q[:, ELBOW] = np.linspace(-np.pi, np.pi, len(q))
        sign = np.sign(determinant(arm, q))
        (change,) = np.nonzero(sign[:-1] != sign[1:])
        if not len(change):
            continue
        low, high = q[change[0]], q[change[0] + 1]
        for _ in range(60):
            middle = (low + high) / 2
            same = np.sign(determinant(arm, middle)) == sign[change[0]]
            low, high = (middle, high) if same else (low, middle)
        found.append(low)
    return np.array(found)


def near_folds(arm, seed, count):
    rng = np.random.default_rng(seed)
    q = at_fold(arm, rng, count)
    q[:, ELBOW] += 10 ** rng.uniform(-6, -2, count) * rng.choice((-1, 1), count)
    return q


def is_among(solutions, q):
    return (np.abs(solutions.distances_from(q)).max(-1) < 1e-6).any(-1)


def searched(arm, T, rng):
    """Search for inverse kinematics solutions by damped least squares from random starts."""
    q = rng.uniform(-np.pi, np.pi, (len(T), STARTS, arm.n))
    for _ in range(STEPS):
        e, J = twists(arm, T, q)
        square = np.einsum("...ij,...kj->...ik", J, J)
        square += (1e-3 * (e**2).sum(-1) + 1e-14)[..., None, None] * np.eye(6)
        step = np.einsum("...ij,...i->...j", J, np.linalg.solve(square, e[..., None])[..., 0])
        q += step * 0.5 / np.maximum(np.abs(step).max(-1, keepdims=True), 0.5)
    e, J = twists(arm, T, q)
    least = np.linalg.svd(J, compute_uv=False)[..., -1]
    return q, (np.abs(e).max(-1) < 1e-10) & (least > KNOWN)


def twists(arm, T, q):
    """Return twists (..., 6) from the tool to target poses, and the Jacobians."""
    here, J = arm.fk_jacobian_mixed(q)
    turn = T[:, None, :3, :3] @ np.swapaxes(here[..., :3, :3], -1, -2)
    skew = (turn - np.swapaxes(turn, -1, -2)) / 2
    angular = np.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], -1)
    far = np.trace(turn, axis1=-2, axis2=-1) < 1.0
    size = np.linalg.norm(angular, axis=-1, keepdims=True)
    angular = np.where(far[..., None], angular / np.maximum(size, 1e-9), angular)
    return np.concatenate([T[:, None, :3, 3] - here[..., :3, 3], angular], -1), J


def test_ik_near_folds_recovers_generating_configuration(case):
    arm, fk = case
    q = near_folds(arm, 0, 60)
    solutions = arm.ik(arm.fk(q))
    assert is_among(solutions, q).all()
    for k in range(0, 60, 10):
        for row in solutions.q[k][solutions.valid[k]]:
            assert np.abs(fk(row) - arm.fk(q[k])).max() < TRUE


def test_solution_count_near_folds_is_even(case):
    arm, fk = case
    rng = np.random.default_rng(1)
    q = at_fold(arm, rng, 100)
    T = arm.fk(q)
    _, J = arm.fk_jacobian_mixed(q)
    least = np.linalg.svd(J)[0][..., -1]
    T[:, :3, 3] += 1e-4 * least[:, :3] * rng.choice((-1, 1), (100, 1))
    solutions = arm.ik(T)
    assert (solutions.count % 2 == 0).mean() > 0.97
    for k in range(0, 100, 10):
        for row in solutions.q[k][solutions.valid[k]]:
            assert np.abs(fk(row) - T[k]).max() < TRUE


def test_random_search_near_folds_finds_no_extra_solutions(case):
    arm, _ = case
    rng = np.random.default_rng(2)
    q = near_folds(arm, 3, 40)
    T = arm.fk(q)
    solutions = arm.ik(T)
    rows, good = searched(arm, T, rng)
    checked = 0
    for k in range(len(T)):
        for row in rows[k][good[k]]:
            apart = np.remainder(solutions.q[k] - row + np.pi, 2 * np.pi) - np.pi
            apart[~solutions.valid[k]] = np.inf
            assert np.abs(apart).max(-1).min() < 1e-5
            checked += 1
    assert checked > 40 * 10


def test_ik_recovers_configurations_with_nearly_aligned_wrist(case):
    """In the tested configurations, two wrist axes nearly coincide."""
    arm, _ = case
    rng = np.random.default_rng(4)
    q = rng.uniform(-np.pi, np.pi, (300, arm.n))
    q[:, WRIST] = rng.uniform(-1, 1, 300) * ERROR
    assert is_among(arm.ik(arm.fk(q)), q).mean() > 0.98
