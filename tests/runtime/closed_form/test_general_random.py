"""The inverse of arms that nobody chose: random axes, some of which meet or are parallel."""

import numpy as np
import pytest
from compiling import compiled

from bench.accuracy.general_arms import DERIVED, Judged
from bench.cases.random_arms import random_arm

ARMS = {
    "skew": (11, "//////"),
    "two_parallel_wrist_offset": (12, "x=//x/"),
    "seven_with_meeting_axes": (16, "xx/x/x/"),
    "six_a_torso_and_a_slide": (17, "/x//=///", {3}),
}


@pytest.fixture(scope="module", params=ARMS)
def judged(request, tmp_path_factory):
    robot = random_arm(*ARMS[request.param])
    folder = tmp_path_factory.mktemp("random") / request.param
    return Judged(robot, compiled(robot, folder, DERIVED))


def uniform(judged, count, seed):
    return np.random.default_rng(seed).uniform(-np.pi, np.pi, (count, len(judged.robot.moving)))


def test_no_random_pose_is_lost_and_no_wrong_one_is_valid(judged):
    regular, lost, none, wrong = judged.lost(uniform(judged, 500, 1))
    assert regular >= 490
    assert (lost, none, wrong) == (0, 0, 0)


def test_no_pose_of_right_angles_is_lost(judged):
    q = np.random.default_rng(2).integers(0, 4, (100, len(judged.robot.moving))) * np.pi / 2
    regular, lost, none, wrong = judged.lost(q)
    assert regular >= 40
    assert (lost, none, wrong) == (0, 0, 0)


def test_there_are_as_many_solutions_as_newton_finds(judged):
    q = uniform(judged, 3, 3)
    assert judged.counts(judged.arm.fk(q), q, np.random.default_rng(4)) == 0


def test_given_joints_keep_their_values(judged):
    given = [k for k in range(len(judged.robot.moving)) if judged.is_given(k)]
    assert len(given) == len(judged.robot.moving) - 6
    q = uniform(judged, 50, 5)
    solutions = judged.arm.ik(judged.arm.fk(q), *judged.given(q))
    for k in given:
        assert (solutions.q[..., k] == q[:, None, k]).all()
