"""Five revolute joints without a structure: each pose that they reach has its solutions."""

import numpy as np
import pytest
from compiling import compiled

from bench.accuracy.general_arms import Judged
from bench.cases.random_arms import random_arm
from bench.cases.synthetic import robot_of
from chasles.derive import explain

CHAIN = "R/R/R/R/R"
"""Five skew axes."""


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    """The arm, derived and compiled."""
    folder = tmp_path_factory.mktemp("five") / "arm"
    return compiled(robot_of(CHAIN), folder)


def test_its_steps_are_told():
    told = explain(robot_of(CHAIN))
    assert "an arm of five revolute joints without a structure" in told.line
    assert "tool_axis is a sixth joint" in str(told)


@pytest.mark.parametrize("right", [False, True])
def test_every_pose_has_the_configuration_that_made_it(arm, right):
    rng = np.random.default_rng(right)
    q = rng.integers(-1, 3, (200, 5)) * np.pi / 2 if right else rng.uniform(-3, 3, (500, 5))
    T = arm.fk(q)
    found = arm.ik(T)
    assert found.q.shape == (len(q), 16, 5)
    far = np.abs((found.q - q[:, None] + np.pi) % (2 * np.pi) - np.pi).max(axis=-1)
    assert (found.valid & (far < 1e-6)).any(axis=1).all()
    error = np.abs(arm.fk(found.q) - T[:, None]).max(axis=(-1, -2))
    assert error[found.valid].max() < 2e-9
    # Solutions come first, and none is there twice.
    assert not (found.valid[:, 1:] & ~found.valid[:, :-1]).any()
    two = found.valid[:, 1]
    apart = np.abs(found.q[two, 0] - found.q[two, 1]).max(axis=-1)
    assert (apart > 1e-6).all()


def test_five_joints_of_which_one_slides_lose_no_pose(tmp_path):
    robot = random_arm(7, "/////", {3})
    arm = compiled(robot, tmp_path / robot.name)
    assert "joint_4 slides: its displacement" in str(explain(robot))
    q = np.random.default_rng(1).uniform(-1, 1, (1000, 5))
    assert Judged(robot, arm).lost(q) == (1000, 0, 0, 0)


def test_a_pose_that_five_joints_miss_is_none_of_theirs(arm):
    T = arm.fk(np.random.default_rng(3).uniform(-3, 3, (50, 5)))
    T[:, :3, 3] += 0.01
    found = arm.ik(T)
    assert not found.valid.any()
    left = np.linalg.norm(arm.fk(found.q)[..., :3, 3] - T[:, None, :3, 3], axis=-1)
    assert (found.residual >= left - 1e-12).all()
    assert not arm.ik(np.full((4, 4), np.nan)).valid.any()
