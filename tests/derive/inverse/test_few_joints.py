"""Inverse kinematics of arms with few joints, some with a rotated hand or a virtual axis.

The arms have one, four or five joints.
"""

import numpy as np
import pytest

import chasles
from chasles.derive import explain, read
from chasles.derive.inverse.classify import classify
from chasles.derive.terms.terms import Terms
from tests.campaigns.losses import losses_of, trial
from tests.support.generators.drawn_arms import cases_of, random_arm
from tests.support.generators.poses import PoseSet
from tests.support.generators.synthetic import robot_of
from tests.support.oracles.verdict import judged

TITLE = "a turntable with two parallel axes and a revolute wrist joint"
CHAINS = ("R/R=R/R", "RxR=R+R")
SOLD = """<robot name="arm"><link name="base"/>
<link name="l1"/><link name="l2"/><link name="l3"/><link name="l4"/><link name="tool0"/>
<joint name="yaw" type="revolute"><parent link="base"/><child link="l1"/>
  <axis xyz="0 0 1"/><limit lower="-2.9" upper="2.9"/></joint>
<joint name="shoulder" type="revolute"><parent link="l1"/><child link="l2"/>
  <origin xyz="0 0 0.14" rpy="-1.5707963 0 0"/><axis xyz="0 0 1"/>
  <limit lower="-1.5" upper="1.5"/></joint>
<joint name="elbow" type="revolute"><parent link="l2"/><child link="l3"/>
  <origin xyz="0.05 -0.35 0"/><axis xyz="0 0 1"/><limit lower="-1.6" upper="1.3"/></joint>
<joint name="wrist" type="revolute"><parent link="l3"/><child link="l4"/>
  <origin xyz="0.25 0 0" rpy="0 1.5707963 0"/><axis xyz="0 0 1"/>
  <limit lower="-3" upper="3"/></joint>
<joint name="flange" type="fixed"><parent link="l4"/><child link="tool0"/>
  <origin xyz="0 0 {along}" rpy="0 0 0.3"/></joint></robot>"""


REACHING_OTHER_AXES = (61035130000014, 19126538000017, 7102000005)
"""Seeds of random arms in which the position of a point on the last axis determines the first three
joint values."""


def lost_of(cases):
    """Describe the pose sets for which an inverse kinematics function misses solutions."""
    return [str(loss) for case in cases for loss in losses_of(case, 0)]


@pytest.mark.parametrize("right", [False, True])
@pytest.mark.parametrize("chain", ["R", "P"])
def test_single_joint_ik_solves_every_pose(chain, right):
    cases = cases_of(robot_of(chain, right=right))
    assert [case.inverses.classification.found.title for case in cases] == [
        "joints that a pose determines one by one"
    ]
    assert not lost_of(cases)


@pytest.mark.parametrize("seed", REACHING_OTHER_AXES)
def test_point_of_the_last_axis_determines_the_first_three_joints(seed):
    outcome = trial(seed)
    assert outcome.counts["inverses"] > 0
    assert not outcome.failures


def test_slider_crank_ik_returns_both_crank_branches():
    press = chasles.load("slider_crank")
    q = np.linspace(-3, 3, 50)[:, None]
    T = press.fk(q)
    found = press.ik(T)
    assert found.valid.all()
    assert found.q.shape == (50, 2, 1)
    np.testing.assert_allclose(
        press.fk(found.q), np.broadcast_to(T[:, None], (50, 2, 4, 4)), atol=1e-9
    )
    apart = np.abs(np.exp(1j * found.q) - np.exp(1j * q[:, None]))
    np.testing.assert_allclose(apart.min(axis=(1, 2)), 0, atol=1e-9)
    moved = T.copy()
    moved[:, 1, 3] += 0.01
    assert not press.ik(moved).valid.any()


@pytest.mark.parametrize(
    ("chain", "right"), [*((chain, False) for chain in CHAINS), ("R/R=R/R", True)]
)
def test_ik_of_turntable_arms_solves_every_pose(chain, right):
    cases = cases_of(robot_of(chain, right=right))
    assert "ik" in {case.function for case in cases}
    assert {case.inverses.classification.found.title for case in cases} == {TITLE}
    assert not lost_of(cases)


def test_five_joint_ik_with_added_axis_solves_every_pose():
    robot = robot_of("R/R=R/RxR")
    words = explain(robot)
    assert "spherical wrist, with added_axis at 0 in addition to the arm's joints" in words.line
    assert "added_axis at 0" in str(words)
    (case,) = cases_of(robot, words.inverses)
    assert case.function == "ik"
    assert case.inverses.classification.found.title == "spherical wrist"
    assert [axis.name for axis in case.inverses.classification.lines.added] == ["added_axis"]
    assert not lost_of([case])


def test_no_axis_is_added_to_arms_with_mimic_joints(tmp_path):
    path = tmp_path / "arm.urdf"
    fifth = '<mimic joint="elbow" multiplier="-1"/><limit lower="-3" upper="3"/>'
    wrist = SOLD.replace('<limit lower="-3" upper="3"/>', fifth).replace("{along}", "0.1")
    last = """<link name="l5"/><joint name="last" type="continuous"><parent link="tool0"/>
    <child link="l5"/><axis xyz="0 1 0"/></joint></robot>"""
    path.write_text(wrist.replace("</robot>", last))
    robot = read(path)
    assert (len(robot.moving), len(robot.coordinates)) == (5, 4)
    assert "follows other coordinates" in explain(robot).line


@pytest.mark.parametrize("seed", [604])
def test_added_axis_is_chosen_to_solve_right_angle_poses(seed):
    cases = cases_of(random_arm(seed))
    assert [case.function for case in cases] == ["ik"]
    assert not cases[0].inverses.functions["ik"].role.searches
    assert not lost_of(cases)


def test_five_joints_without_meeting_adjacent_axes_lack_closed_form():
    assert not cases_of(robot_of("R/R/R/R/R"))


@pytest.fixture(scope="module")
def sold(tmp_path_factory):
    """Derive inverses of an arm.

    The tool origin is on the hand axis.
    """
    path = tmp_path_factory.mktemp("arm") / "arm.urdf"
    path.write_text(SOLD.format(along="0.1"))
    return cases_of(read(path))


def test_position_ik_uses_three_joints_if_tool_is_on_last_axis(sold):
    assert {case.function for case in sold} == {"ik", "ik_position"}
    assert not lost_of(sold)
    (case,) = (case for case in sold if case.function == "ik_position")
    assert case.still == (3,)
    q = case.random(np.random.default_rng(0), 500)
    found = judged(case, PoseSet("with a turned hand", q), case.answers)
    assert (found.missed, found.wrong) == (0, 0)


def test_ik_with_hand_along_first_axis_keeps_joint_sum(sold):
    (case,) = (case for case in sold if case.function == "ik")
    q = case.random(np.random.default_rng(1), 200)
    q[:, 1] = -np.pi / 2 - np.arctan2(-0.35, 0.05)
    q[:, 2] = -np.pi / 2 - q[:, 1]
    np.testing.assert_allclose(case.pose(q)[:, :2, 3], 0, atol=1e-12)
    found = judged(case, PoseSet("upright", q), case.answers)
    assert (found.missed, found.wrong) == (0, 0)
    answers = case.found(q)
    sums = [np.exp(1j * (of[..., 0] + of[..., 3])) for of in (answers.q, q[:, None])]
    assert np.abs(sums[0] - sums[1])[answers.valid].max() < 1e-9


@pytest.mark.parametrize("chain", ["R=R=R/R", "R/R/R/R"])
def test_other_four_joint_chains_are_not_turntable_arms(chain):
    found = classify(robot_of(chain), Terms({})).found
    assert found is None or found.family.title != TITLE
