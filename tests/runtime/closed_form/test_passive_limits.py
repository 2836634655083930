"""Solutions of robots with loops respect the limits of joints that are not actuated."""

import numpy as np
import pytest

from chasles.derive import read_text
from tests.support.compiling import compiled

FIVE_BAR = """
name = "five_bar"
convention = "urdf"
actuated = ["left", "right"]
units = { length = "mm", angle = "deg" }
tool = { body = "left_link", xyz = [300, 0, 0] }
reference = { left = 110, left_elbow = -55, right = 70, right_elbow = 415 }

[[joints]]
name = "left"
link = "left"
xyz = [-100, 0, 0]
axis = [0, 0, 1]
[[joints]]
name = "left_elbow"
link = "left_link"
xyz = [200, 0, 0]
axis = [0, 0, 1]
limits = [-150, -20]
[[joints]]
name = "right"
parent = "0"
link = "right"
xyz = [100, 0, 0]
axis = [0, 0, 1]
[[joints]]
name = "right_elbow"
link = "right_link"
xyz = [200, 0, 0]
axis = [0, 0, 1]
limits = [300, 420]
[[joints]]
name = "wheel"
parent = "right"
link = "wheel"
axis = [0, 0, 1]
limits = [-58, 100]
[[closures]]
name = "pin"
kind = "pin"
a = { body = "right_link", xyz = [300, 0, 0] }
b = { body = "left_link", xyz = [300, 0, 0] }
[couplings]
wheel = { right_elbow = -1, offset = 360 }
"""
LIMITS = [[-150, -20], [300, 420], [-58, 100]]
"""Limits of the left elbow, the right elbow and the wheel (degree)."""
TURN = 2 * np.pi


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    functions = ["fk", "ik", "configuration"]
    return compiled(read_text(FIVE_BAR), tmp_path_factory.mktemp("robot"), functions, ["c"])


def passive(q, tip):
    """Return the angles (..., 3) of left elbow, right elbow and wheel at a tip position."""
    found = []
    for k, x in enumerate((-0.1, 0.1)):
        crank = [x + 0.2 * np.cos(q[..., k]), 0.2 * np.sin(q[..., k])]
        found.append(np.arctan2(tip[..., 1] - crank[1], tip[..., 0] - crank[0]) - q[..., k])
    left, right = (np.remainder(angle + np.pi, TURN) - np.pi for angle in found)
    right = right + TURN
    return np.stack([left, right, TURN - right], -1)


def is_inside(q, tip):
    values, (lower, upper) = passive(q, tip), np.radians(LIMITS).T
    return ((values >= lower) & (values <= upper)).all(-1)


def nearest(solutions, tip, q_seed, limits=(-np.inf, np.inf)):
    """Return the solution within all limits that is nearest to a seed, or NaN."""
    q = solutions.valid_q()
    q = q_seed + np.remainder(q - q_seed + np.pi, TURN) - np.pi
    q = q[is_inside(q, tip) & ((q >= limits[0]) & (q <= limits[1])).all(-1)]
    return q[np.abs(q - q_seed).max(-1).argmin()] if len(q) else np.full(2, np.nan)


@pytest.fixture(scope="module")
def poses(robot):
    q = np.random.default_rng(0).uniform(-1, 1, (300, 2)) + robot.q_reference
    T = robot.fk(q)
    return T[np.isfinite(T).all((-2, -1))]


def test_ik_nearest_selects_among_solutions_with_passive_joints_inside(robot, poses):
    seeds = robot.q_reference + np.random.default_rng(1).uniform(-4, 4, (len(poses), 2))
    solutions = robot.ik(poses)
    expected = np.array([nearest(solutions.at(k), T[:2, 3], seeds[k]) for k, T in enumerate(poses)])
    found = robot.ik_nearest(poses, seeds)
    np.testing.assert_allclose(found.q, expected, atol=1e-9)
    one = [robot.ik_nearest(T, seed) for T, seed in zip(poses, seeds, strict=True)]
    np.testing.assert_allclose([o.q for o in one], found.q, atol=1e-12)
    assert {o.reason for o in one if not o.valid} == {"limits"}
    assert 20 < found.valid.sum() < len(poses) - 20
    free = robot.ik_nearest(poses, seeds, limits=None)
    assert free.valid.all()
    ends = robot.q_reference - 0.9, robot.q_reference + 0.3
    tight = robot.ik_nearest(poses, robot.q_reference, limits=np.transpose(ends))
    expected = [
        nearest(solutions.at(k), T[:2, 3], robot.q_reference, ends) for k, T in enumerate(poses)
    ]
    np.testing.assert_allclose(tight.q, expected, atol=1e-9)
    assert tight.valid.any()


def test_within_limits_keeps_solutions_with_passive_joints_inside(robot, poses):
    solutions = robot.ik(poses)
    kept = solutions.within_limits()
    expected = solutions.valid & is_inside(solutions.q, poses[:, None, :2, 3])
    assert np.array_equal(kept.valid, expected)
    assert np.array_equal(solutions.within_limits(None).valid, solutions.valid)
    assert 0 < expected.sum() < solutions.valid.sum()
    found = robot.ik_nearest(poses, robot.q_reference)
    assert np.array_equal(found.valid, kept.valid.any(-1))


def test_ik_path_ends_at_the_limit_of_a_passive_joint(robot):
    q = robot.q_reference + np.linspace(0, 1, 50)[:, None] * [0.9, 0.0]
    T = robot.fk(q)
    inside = is_inside(q, T[:, :2, 3])
    path = robot.ik_path(T, robot.q_reference)
    assert (path.reason, path.coordinate) == ("limit", "wheel")
    assert path.ended_at == np.flatnonzero(~inside)[0]
