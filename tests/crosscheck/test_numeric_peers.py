"""Iterative inverses agree with SciPy's bounded least squares and the Robotics Toolbox."""

import numpy as np
import pytest

import chasles
from chasles import so3
from tests.support.optional import OptionalPackage
from tests.support.oracles.numeric_tasks import (
    ALONE,
    COMPARED,
    TOLERANCE,
    errors,
    missed,
    numeric_task,
)
from tests.support.oracles.screws import screws
from tests.support.tolerances import AGREEMENT

optimize = pytest.importorskip("scipy.optimize", reason="an oracle needs the extra `crosscheck`")
rtb = OptionalPackage("roboticstoolbox")

POSES = 300
STARTS = 5
NEAREST = 1e-7
"""Amount [m, rad] by which the pose error of `ik_numeric` may exceed the smallest error that SciPy
finds."""
POSITION = (1, 1, 1, 0, 0, 0)
OUT_OF_REACH = ("ur5e", "iiwa14", "lynxmotion")


@pytest.mark.parametrize("name", [*COMPARED, *ALONE])
def test_ik_numeric_solves_every_reachable_pose(name):
    task = numeric_task(name, POSES)
    assert len(task.T) == POSES
    found = task.solve(task.T)
    assert found.valid.all()
    assert ((found.q >= task.robot.lower) & (found.q <= task.robot.upper)).all()
    assert missed(task) == 0


@pytest.mark.parametrize("name", [*COMPARED, "iiwa14", "jaco2", "photo_robot"])
def test_ik_numeric_solutions_match_product_of_exponentials(name):
    task = numeric_task(name, POSES)
    T = screws(name).fk(task.solve(task.T).q)
    assert np.abs(T - task.T).max() <= 2 * TOLERANCE


@pytest.mark.parametrize("name", COMPARED)
def test_peer_model_has_same_kinematics_and_limits(name):
    from tests.support.peers import toolbox_lm as peer

    robot = chasles.load(name)
    elements = peer.sequence(screws(name), robot.lower, robot.upper)
    np.testing.assert_array_equal(elements.qlim, [robot.lower, robot.upper])
    inverse = peer.inverse(screws(name), robot.lower, robot.upper)
    q = np.random.default_rng(0).uniform(robot.lower, robot.upper, (5, robot.n))
    for row, T in zip(q, robot.fk(q), strict=True):
        assert np.abs(elements.eval(row) - T).max() <= AGREEMENT
        found = inverse(T)
        assert found.valid
        assert np.abs(robot.fk(found.q) - T).max() <= 1e-6


def reach_beyond(robot, count):
    """Return poses that are 10 % farther from the base than the tool can reach."""
    T = numeric_task(robot.name, 2000).T
    reach = np.linalg.norm(T[:, :3, 3], axis=1)
    T = T[:count].copy()
    T[:, :3, 3] *= 1.1 * reach.max() / reach[:count, None]
    return T


def some(robot, count):
    limits = np.clip([robot.lower, robot.upper], -np.pi, np.pi)
    return np.random.default_rng(8).uniform(*limits, (count, robot.n))


def scipys(error, robot, q, jac="2-point"):
    """Return the smallest norm of ``error`` that SciPy finds within the joint limits."""
    tight = {"xtol": 1e-15, "ftol": 1e-15, "gtol": 1e-15}
    limits = (robot.lower, robot.upper)
    return np.sqrt(2 * optimize.least_squares(error, q, jac, limits, **tight).cost)


@pytest.mark.parametrize("name", OUT_OF_REACH)
def test_unreachable_position_is_as_near_as_scipy(name):
    robot = chasles.load(name)
    T = reach_beyond(robot, 1)
    found = robot.ik_numeric(T, task_weights=POSITION)
    assert not found.valid.any()
    assert found.iterations.max() <= 10_000
    for residual, pose in zip(found.residual, T, strict=True):

        def error(q, pose=pose):
            return robot.fk(q)[:3, 3] - pose[:3, 3]

        def jacobian(q):
            return robot.jacobian_mixed(q)[:3]

        nearest = min(scipys(error, robot, q, jacobian) for q in some(robot, STARTS))
        assert residual <= nearest + NEAREST


@pytest.mark.parametrize("name", ["ur5e", "iiwa14"])
def test_unreachable_pose_error_is_as_small_as_scipy(name):
    robot = chasles.load(name)
    T = reach_beyond(robot, 1)
    found = robot.ik_numeric(T)
    assert not found.valid.any()
    for q, pose in zip(found.q, T, strict=True):

        def error(x, pose=pose):
            reached = robot.fk(x)
            turn = so3.log(pose[:3, :3] @ reached[:3, :3].T)
            return np.concatenate([pose[:3, 3] - reached[:3, 3], turn])

        inside = np.clip(q, robot.lower + 1e-9, robot.upper - 1e-9)
        nearby = scipys(error, robot, inside)
        far = min(scipys(error, robot, start) for start in some(robot, 5))
        assert np.linalg.norm(error(q)) <= min(nearby, far) + NEAREST


def test_benchmark_counts_missed_poses():
    task = numeric_task("ur5e", 50)
    assert missed(task) == 0
    task.T[7, :3, 3] *= 100
    task.T[9] = np.nan
    assert missed(task) == 2


def test_benchmark_detects_false_success():
    task = numeric_task("panda", 20)
    results = [task.solve(pose) for pose in task.T]
    assert np.isfinite(errors(task, results)).all()
    results[3] = results[3]._replace(q=task.robot.upper + np.array([0, 0, 0, 1e-12, 0, 0, 0]))
    results[5] = results[5]._replace(q=results[5].q + 1e-6)
    error = errors(task, results)
    assert np.isnan(error[3])
    assert 1e-7 < error[5] < 1e-4
