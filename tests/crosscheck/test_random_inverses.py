"""Inverses of random arms with round dimensions miss no pose and return no wrong solution.

The tested poses have joint angles that are random or multiples of 90 degrees.
"""

import numpy as np
import pytest

from tests.campaigns import losses
from tests.campaigns.losses import determines, losses_of, right_angles, sets
from tests.support.generators.drawn_arms import cases_of, random_arm
from tests.support.generators.poses import PoseSet
from tests.support.generators.synthetic import robot_of
from tests.support.oracles.verdict import judged

FIVE_JOINTS = (389,)
"""Seed of a random five-joint arm whose poses equal those of a six-joint arm with the last joint at
0."""
OBLIQUE_WRISTS = (80,)
"""Seed of a random arm whose wrist reaches only some orientations, and whose pose does not
determine one joint rotation."""
LOST_BEFORE = (50925,)
"""Seed of a random arm with poses that the closed-form inverse kinematics function misses without
refinement."""
FOLDED = (33, 20350, 53401)
"""Seeds of random arms that can be nearly folded at the elbow."""
OTHERS = (88, 764, 1478)
SLIDES = (
    *((chain, False) for chain in ("P=R/P", "RLPLR/RxrxR")),
    *((chain, True) for chain in ("RLPLP", "P=RLP/RxrxR", "R/P/P/RxrxR")),
)
"""Axis structures of arms. The flag of a structure is True if its skew axes are at right angles."""


def clean(case, seed):
    """Assert that an arm's unrefined inverse kinematics is complete and correct."""
    for chosen, poses in sets(case, np.random.default_rng(seed)):
        if poses.name.startswith("near"):
            continue
        found = judged(chosen, poses, chosen.answers)
        assert (found.missed, found.wrong, found.lost or 0) == (0, 0, 0), poses.name


@pytest.mark.parametrize("seed", [*OBLIQUE_WRISTS, *OTHERS])
def test_random_arms_miss_no_pose(seed):
    cases = cases_of(random_arm(seed))
    assert cases
    for case in cases:
        clean(case, seed)


@pytest.mark.parametrize("seed", FIVE_JOINTS)
def test_five_joint_arm_misses_no_pose_with_tool_axis_as_sixth_joint(seed):
    cases = cases_of(random_arm(seed))
    assert cases[0].robot.n == 5
    assert cases[0].inverses.classification.lines.axes[-1].name == "tool_axis"
    for case in cases:
        clean(case, seed)


@pytest.mark.parametrize(("chain", "right"), SLIDES)
def test_prismatic_joints_around_revolute_joint_miss_no_pose(chain, right):
    cases = cases_of(robot_of(chain, right=right))
    assert cases
    for case in cases:
        clean(case, 0)


def test_turntable_position_inverse_moves_fourth_joint_if_needed():
    functions = {case.function: case for case in cases_of(robot_of("R+R=R=R", right=True))}
    case = functions["ik_position"]
    q = case.random(np.random.default_rng(0), 1000)
    found = case.found(q)
    assert found.valid.any(axis=1).all()
    bent = np.abs(found.q[..., 3]).max(axis=1) > 1e-6
    assert 0 < bent.sum() < 1000
    q[:, 3] = 0
    assert not case.found(q).q[..., 3].any()


def test_turntable_with_moving_fifth_joint_has_no_position_task():
    functions = {case.function for case in cases_of(robot_of("R+R=R=RLR", right=True))}
    assert functions == {"ik"}


def test_horizontal_turntable_has_no_pitch_task():
    functions = {case.function for case in cases_of(random_arm(6228))}
    assert functions == {"ik", "ik_position", "ik_position_direction"}


def test_arm_confined_to_surface_has_no_position_task():
    (case,) = cases_of(random_arm(292))
    assert case.function == "ik"
    clean(case, 0)


@pytest.mark.parametrize("chain", ["R/R/R=R=R/R"])
def test_parallel_forearm_misses_no_right_angle_pose(chain, monkeypatch):
    monkeypatch.setattr(losses, "RIGHT", 300)
    (case,) = cases_of(robot_of(chain, right=True))
    q = right_angles(case, np.random.default_rng(0))
    assert len(q) == 300
    found = judged(case, PoseSet("right angles", q, regular=determines(case)), case.answers)
    assert (found.missed, found.wrong, found.lost) == (0, 0, 0)


def test_canceling_prismatic_joints_do_not_make_axes_intersect():
    assert not cases_of(random_arm(62867))


@pytest.mark.parametrize("seed", FOLDED)
def test_nearly_folded_elbow_misses_no_pose(seed):
    found = [loss for case in cases_of(random_arm(seed)) for loss in losses_of(case, seed)]
    assert not found, "\n".join(map(str, found))


@pytest.mark.parametrize("seed", LOST_BEFORE)
def test_refinement_recovers_poses_that_closed_form_misses(seed):
    """The test uses the same refinement as a robot's ``ik``."""
    rng = np.random.default_rng(seed)
    unrefined = 0
    for case in cases_of(random_arm(seed)):
        for chosen, poses in sets(case, rng):
            bare, found = (judged(chosen, poses, how) for how in (chosen.answers, chosen.refined))
            unrefined += bare.missed
            assert (found.missed, found.wrong) == (0, 0), poses.name
    assert unrefined > 0
