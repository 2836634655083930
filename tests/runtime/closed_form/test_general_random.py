"""Tests the inverse of random arms, some of which have intersecting or parallel axes.

The inverse of each five-joint arm finds the known solutions of reachable poses. Some six-joint arms
have prismatic joints.
"""

import numpy as np
import pytest

from chasles.derive import explain, read_text
from tests.campaigns.general import DERIVED, Judged
from tests.support.compiling import compiled
from tests.support.fixed import fixed_values
from tests.support.generators.drawn_arms import random_arm as drawn_arm
from tests.support.generators.geometric_errors import displaced
from tests.support.generators.random_arms import random_arm
from tests.support.generators.synthetic import robot_of

ARM = 16, "xx/x/x/"
"""Seed and axis relations of a random arm with seven joints. The test campaign `general` covers
other arms."""
CHAIN = "R/R/R/R/R"
"""Axis structure of an arm with five skew axes."""
COLLINEAR = {
    "wrist": [(0.3, 0.1, 70), (0.1, 0.4, 20), (0.1, 0.3, -80), (0.2, 0.1, 60), (0.1, 0, 0)],
    "base": [(0.3, 0, 0), (0.1, 0.4, 90), (0.1, 0.3, 0), (0.2, 0.1, 90), (0.1, 0, -90)],
}
"""DH rows (d, a, alpha) of arms with two coincident axes: joints 5 and 6, or joints 1 and 2."""
LAST = (0.1, 0.1, 30)


@pytest.fixture(scope="module")
def judged(tmp_path_factory):
    robot = random_arm(*ARM)
    folder = tmp_path_factory.mktemp("random") / "seven"
    return Judged(robot, compiled(robot, folder, DERIVED, ["c"]))


def uniform(judged, count, seed):
    return np.random.default_rng(seed).uniform(-np.pi, np.pi, (count, len(judged.robot.moving)))


def test_random_poses_are_all_solved_correctly(judged):
    regular, lost, none, wrong = judged.lost(uniform(judged, 150, 1))
    assert regular >= 145
    assert (lost, none, wrong) == (0, 0, 0)


def test_right_angle_poses_are_all_solved_correctly(judged):
    q = np.random.default_rng(2).integers(0, 4, (100, len(judged.robot.moving))) * np.pi / 2
    regular, lost, none, wrong = judged.lost(q)
    assert regular >= 40
    assert (lost, none, wrong) == (0, 0, 0)


def test_solution_count_matches_multi_start_newton(judged):
    q = uniform(judged, 2, 3)
    assert judged.counts(judged.arm.fk(q), q, np.random.default_rng(4)) == 0


def test_fixed_joints_keep_their_values(judged):
    given = [k for k in range(len(judged.robot.moving)) if judged.is_fixed(k)]
    assert len(given) == len(judged.robot.moving) - 6
    q = uniform(judged, 50, 5)
    solutions = judged.arm.ik(judged.arm.fk(q), fixed=judged.fixed(q))
    for k in given:
        assert (solutions.q[..., k] == q[:, None, k]).all()


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    folder = tmp_path_factory.mktemp("five") / "arm"
    return compiled(robot_of(CHAIN), folder, DERIVED, ["c"])


def test_explain_names_five_joint_method():
    message = explain(robot_of(CHAIN))
    assert "an arm of five revolute joints without a structure" in message.line
    assert "tool_axis is an added sixth joint" in str(message)


@pytest.mark.parametrize("right", [False, True])
def test_five_joint_ik_recovers_generating_configuration(arm, right):
    rng = np.random.default_rng(right)
    q = rng.integers(-1, 3, (200, 5)) * np.pi / 2 if right else rng.uniform(-3, 3, (200, 5))
    T = arm.fk(q)
    found = arm.ik(T)
    assert found.q.shape == (len(q), 16, 5)
    far = np.abs((found.q - q[:, None] + np.pi) % (2 * np.pi) - np.pi).max(axis=-1)
    assert (found.valid & (far < 1e-6)).any(axis=1).all()
    error = np.abs(arm.fk(found.q) - T[:, None]).max(axis=(-1, -2))
    assert error[found.valid].max() < 2e-9
    # Valid solution slots come first, and each solution occurs only once.
    assert not (found.valid[:, 1:] & ~found.valid[:, :-1]).any()
    two = found.valid[:, 1]
    apart = np.abs(found.q[two, 0] - found.q[two, 1]).max(axis=-1)
    assert (apart > 1e-6).all()


def test_five_joint_arm_with_prismatic_joint_misses_no_pose(tmp_path):
    robot = random_arm(7, "/////", {3})
    arm = compiled(robot, tmp_path / robot.name, DERIVED, ["c"])
    assert "joint_4 is prismatic: its displacement" in str(explain(robot))
    q = np.random.default_rng(1).uniform(-1, 1, (100, 5))
    assert Judged(robot, arm).lost(q) == (100, 0, 0, 0)


def test_pose_unreachable_by_five_joints_is_invalid(arm):
    T = arm.fk(np.random.default_rng(3).uniform(-3, 3, (50, 5)))
    T[:, :3, 3] += 0.01
    found = arm.ik(T)
    assert not found.valid.any()
    left = np.linalg.norm(arm.fk(found.q)[..., :3, 3] - T[:, None, :3, 3], axis=-1)
    assert (found.residual >= left - 1e-12).all()
    assert not arm.ik(np.full((4, 4), np.nan)).valid.any()


LAST_SLIDES = """
name = "last_slides"
convention = "urdf"
tool = { xyz = [0.05, 0, 0] }
joints = [
  { name = "j1", xyz = [0, 0, 0.3], axis = [0, 0, 1] },
  { name = "j2", xyz = [0.1, 0, 0.2], axis = [0, 1, 0] },
  { name = "j3", xyz = [0.3, 0, 0.1], axis = [0, 1, 0] },
  { name = "j4", xyz = [0.3, 0, 0], axis = [1, 0, 0] },
  { name = "j5", xyz = [0.1, 0, 0], axis = [0, 0, 1] },
  { name = "j6", type = "prismatic", xyz = [0.1, 0, 0], axis = [1, 0, 0] },
]
"""
"""Robot file of an arm whose equations for a prismatic joint and an adjacent joint are singular at
multiples of 90 degrees."""


def test_arm_with_last_prismatic_joint_solves_right_angles(tmp_path):
    robot = read_text(LAST_SLIDES)
    arm, rng = compiled(robot, tmp_path, DERIVED, ["c"]), np.random.default_rng(11)
    q = np.pi / 2 * rng.integers(-1, 3, (1200, 6))
    q[:, 5] = rng.uniform(0, 0.4, len(q))
    _, J = arm.fk_jacobian_mixed(q)
    q = q[np.linalg.svd(J, compute_uv=False)[:, -1] > 1e-3]
    assert len(q) > 240
    assert Judged(robot, arm).lost(q)[1:] == (0, 0, 0)


@pytest.mark.parametrize(("name", "pair"), [("wrist", (4, 5)), ("base", (0, 1))])
def test_collinear_axes_have_all_solutions_at_any_value_of_one_joint(tmp_path, name, pair):
    rows = "".join(
        f"[[joints]]\nd = {d}\na = {a}\nalpha = {alpha}\n"
        for d, a, alpha in [*COLLINEAR[name], LAST]
    )
    head = 'name = "arm"\nconvention = "dh"\nunits = { length = "m", angle = "deg" }\n'
    arm = compiled(read_text(head + rows, file="arm.toml"), tmp_path / "arm", DERIVED, ["c"])
    rng, (first, second) = np.random.default_rng(6), pair
    q = np.concatenate([rng.uniform(-3, 3, (100, 6)), rng.integers(0, 4, (100, 6)) * np.pi / 2])
    value = rng.uniform(-3, 3, len(q))
    solutions = arm.ik(arm.fk(q), fixed=fixed_values(arm, [value]))
    assert (solutions.q[..., second] == value[:, None]).all()
    # The tool pose depends only on the sum of the angles of the two joints with coincident axes.
    q[:, first] += q[:, second] - value
    q[:, second] = value
    far = np.abs((solutions.q - q[:, None] + np.pi) % (2 * np.pi) - np.pi).max(axis=-1)
    assert (solutions.valid & (far < 1e-6)).any(axis=1).all()
    error = np.abs(arm.fk(solutions.q) - arm.fk(q)[:, None]).max(axis=(-1, -2))
    assert error[solutions.valid].max() < 2e-9


def test_five_joints_with_a_slide_hold_each_solution_in_one_slot(tmp_path):
    robot = displaced(drawn_arm(3535000047), 2.332494879e-4, 3535000047)
    arm = compiled(robot, tmp_path / "arm", DERIVED, ["c"])
    q = np.random.default_rng(1).integers(0, 4, (300, 5)) * np.pi / 2
    q[:, 2] = 0.4
    solutions = arm.ik(arm.fk(q))
    assert solutions.count.min() >= 1
    np.testing.assert_array_equal(solutions.count, solutions.distinct().count)
