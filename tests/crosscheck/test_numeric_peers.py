"""Iterated inverses against SciPy's bounded least squares and the Robotics Toolbox."""

import numpy as np
import pytest

import chasles
from bench.measures import numeric as bench
from bench.report import Limit, Plan, Ratio
from chasles.screws import log_rotation
from tests.support.oracles.screws import screws
from tests.support.tolerances import AGREEMENT

optimize = pytest.importorskip("scipy.optimize", reason="an oracle, in the extra `crosscheck`")
rtb = pytest.importorskip("roboticstoolbox", reason="an oracle, in the extra `crosscheck`")

POSES = 1000
STARTS = 10
NEAREST = 1e-7
"""By which the least distance may be missed [m, rad]: it is flat there."""
POSITION = (1, 1, 1, 0, 0, 0)
OUT_OF_REACH = ("ur5e", "puma560", "panda", "iiwa14", "jaco2", "lynxmotion")


@pytest.mark.parametrize("name", [*bench.COMPARED, *bench.ALONE])
def test_every_reachable_pose_is_found(name):
    made = bench.task(name, POSES)
    assert len(made.T) == POSES
    found = made.solve(made.T)
    assert found.success.all()
    assert ((found.q >= made.robot.lower) & (found.q <= made.robot.upper)).all()
    assert bench.missed(made).value == 0


@pytest.mark.parametrize("name", [*bench.COMPARED, "iiwa14", "jaco2", "photo_robot"])
def test_poses_by_the_product_of_exponentials_of_the_description(name):
    made = bench.task(name, POSES)
    T = screws(name).fk(made.solve(made.T).q)
    assert np.abs(T - made.T).max() <= 2 * bench.TOLERANCE


@pytest.mark.parametrize("name", bench.COMPARED)
def test_the_peer_has_the_same_arm_and_limits(name):
    from tests.support.peers import toolbox_lm as peer

    robot = chasles.load(name)
    elements = peer.sequence(screws(name), robot.lower, robot.upper)
    np.testing.assert_array_equal(elements.qlim, [robot.lower, robot.upper])
    q = np.random.default_rng(0).uniform(robot.lower, robot.upper, (20, robot.n))
    for row, T in zip(q, robot.fk(q), strict=True):
        assert np.abs(elements.eval(row) - T).max() <= AGREEMENT
        found = peer.inverse(screws(name), robot.lower, robot.upper)(T)
        assert found.success
        assert np.abs(robot.fk(found.q) - T).max() <= 1e-6


def reach_beyond(robot, count):
    """Poses whose place is a tenth further from the base than the tool ever gets."""
    T = bench.task(robot.name, 2000).T
    reach = np.linalg.norm(T[:, :3, 3], axis=1)
    T = T[:count].copy()
    T[:, :3, 3] *= 1.1 * reach.max() / reach[:count, None]
    return T


def some(robot, count):
    """Random coordinates within the limits."""
    limits = np.clip([robot.lower, robot.upper], -np.pi, np.pi)
    return np.random.default_rng(8).uniform(*limits, (count, robot.n))


def scipys(error, robot, q, jac="2-point"):
    """The least length of an error that SciPy gets to within the limits."""
    tight = {"xtol": 1e-15, "ftol": 1e-15, "gtol": 1e-15}
    limits = (robot.lower, robot.upper)
    return np.sqrt(2 * optimize.least_squares(error, q, jac, limits, **tight).cost)


@pytest.mark.parametrize("name", OUT_OF_REACH)
def test_the_nearest_place_is_scipys(name):
    robot = chasles.load(name)
    T = reach_beyond(robot, 3)
    found = robot.ik_numeric(T, weights=POSITION)
    assert not found.success.any()
    assert found.iterations.max() <= 10_000
    for residual, pose in zip(found.residual, T, strict=True):

        def error(q, pose=pose):
            return robot.fk(q)[:3, 3] - pose[:3, 3]

        def jacobian(q):
            return robot.jacobian_mixed(q)[:3]

        nearest = min(scipys(error, robot, q, jacobian) for q in some(robot, STARTS))
        assert residual <= nearest + NEAREST


@pytest.mark.parametrize("name", ["ur5e", "puma560", "iiwa14"])
def test_out_of_reach_it_ends_where_scipy_does(name):
    robot = chasles.load(name)
    T = reach_beyond(robot, 3)
    found = robot.ik_numeric(T)
    assert not found.success.any()
    for q, pose in zip(found.q, T, strict=True):

        def error(x, pose=pose):
            reached = robot.fk(x)
            turn = log_rotation(pose[:3, :3] @ reached[:3, :3].T)
            return np.concatenate([pose[:3, 3] - reached[:3, 3], turn])

        inside = np.clip(q, robot.lower + 1e-9, robot.upper - 1e-9)
        nearby = scipys(error, robot, inside)
        far = min(scipys(error, robot, start) for start in some(robot, 5))
        assert np.linalg.norm(error(q)) <= min(nearby, far) + NEAREST


def test_misses_are_counted():
    made = bench.task("ur5e", 50)
    assert bench.missed(made).value == 0
    made.T[7, :3, 3] *= 100
    made.T[9] = np.nan
    row = bench.missed(made)
    assert row.value == 2
    assert not row.holds


def test_a_success_that_is_none_is_a_miss():
    made = bench.task("panda", 20)
    results = [made.solve(pose) for pose in made.T]
    assert np.isfinite(bench.errors(made, results)).all()
    results[3] = results[3]._replace(q=made.robot.upper + np.array([0, 0, 0, 1e-12, 0, 0, 0]))
    results[5] = results[5]._replace(q=results[5].q + 1e-6)
    error = bench.errors(made, results)
    assert np.isnan(error[3])
    assert 1e-7 < error[5] < 1e-4


def test_every_robot_is_timed():
    found = bench.run(Plan(rounds=1, calls=20, batch=20))
    misses = [row for row in found if isinstance(row, Limit) and row.unit == "poses"]
    assert len(misses) == len(bench.COMPARED) + len(bench.ALONE)
    assert all(row.holds for row in misses)
    ratios = [row for row in found if isinstance(row, Ratio)]
    assert len(ratios) == 3 * len(bench.COMPARED)
    assert all(row.own > 0 and row.peer > 0 for row in ratios)


def test_without_the_peer_it_runs_too(monkeypatch, capsys):
    monkeypatch.setattr(bench, "absent", lambda: {"toolbox": "roboticstoolbox-python"})
    found = bench.run(Plan(rounds=1, calls=5, batch=5))
    assert not [row for row in found if isinstance(row, Ratio)]
    assert "no Robotics Toolbox" in capsys.readouterr().out
