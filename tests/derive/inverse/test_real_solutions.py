"""Real solutions of a general arm, found numerically and by the compiled IK function."""

import numpy as np
import pytest

import chasles
from chasles.derive import read
from chasles.derive.inverse.general.elimination_choice import choose
from chasles.derive.inverse.general.raghavan_roth import forward, numbers
from chasles.derive.inverse.general.real_solutions import real_solutions
from tests.support.derivations import ROBOTS
from tests.support.generators.random_arms import random_arm

POSES = 8
SAME = 1e-10
"""Tolerance for the entries of a pose matrix."""


@pytest.fixture(scope="module")
def arm():
    robot = read(ROBOTS / "jaco2.toml")
    constants = numbers(robot)
    return constants, choose(robot)


def test_real_solutions_reach_pose_and_include_configuration(arm):
    constants, choice = arm
    for q in np.random.default_rng(1).uniform(-3, 3, (POSES, 6)):
        T = forward(constants, q)
        found = real_solutions(constants, choice.orders, T)
        assert len(found) % 2 == 0
        for one in found:
            np.testing.assert_allclose(forward(constants, one), T, atol=SAME)
        assert min(np.abs(np.angle(np.exp(1j * (one - q)))).max() for one in found) <= 1e-6


def test_real_solution_count_matches_compiled_ik(arm):
    constants, choice = arm
    jaco2 = chasles.load("jaco2")
    for q in np.random.default_rng(2).uniform(-3, 3, (POSES, 6)):
        T = forward(constants, q)
        assert len(real_solutions(constants, choice.orders, T)) == jaco2.ik(T).valid.sum()


@pytest.mark.parametrize(
    "slides", [{1}, {0, 5}], ids=lambda slides: "-".join(map(str, sorted(slides)))
)
def test_real_solutions_with_prismatic_joints_reach_the_pose(slides):
    robot = random_arm(6, slides=slides)
    constants, choice = numbers(robot), choose(robot)
    for q in np.random.default_rng(3).uniform(-1, 1, (POSES, 6)):
        T = forward(constants, q, slides)
        found = real_solutions(constants, choice.orders, T, slides)
        assert len(found) % 2 == 0
        for one in found:
            np.testing.assert_allclose(forward(constants, one, slides), T, atol=SAME)
        assert min(np.abs(one - q).max() for one in found) <= 1e-6
