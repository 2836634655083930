"""The derivation avoids or reports IK functions that miss poses at multiples of 90 degrees.

The tested arms are random with fixed seeds. Target poses come from products of exponentials.
"""

from functools import cache

import numpy as np
import pytest

import chasles
from chasles.derive.inverse.lost_poses import TARGETS, configurations, lost_poses
from chasles.derive.inverse.structure.lines import Lines, axes_of
from chasles.derive.inverse.structure.numeric_arm import NumericArm
from chasles.derive.terms.terms import Terms
from tests.campaigns import losses
from tests.campaigns.losses import right_angles, sets
from tests.support.derivations import NAMES
from tests.support.generators.drawn_arms import cases_of, random_arm
from tests.support.generators.poses import PoseSet
from tests.support.oracles.screws import screws_of
from tests.support.oracles.tasks import TASKS
from tests.support.oracles.verdict import judged

OTHER_JOINT_GIVEN = {1462: (1,), 5388: (0, 3)}
SEARCHED = (4220,)


@cache
def pose_case(seed):
    return next(case for case in cases_of(random_arm(seed)) if case.function == "ik")


def lost(case, solve, count=400):
    """Return the number of missed poses.

    All joint angles are multiples of 90 degrees.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(losses, "RIGHT", count)
        q = right_angles(case, np.random.default_rng(3))
    verdict = judged(case, PoseSet("right angles", q), solve)
    assert verdict.poses == count
    assert verdict.wrong == 0
    return verdict.missed


@pytest.mark.parametrize("seed", OTHER_JOINT_GIVEN)
def test_fixed_joints_are_chosen_to_solve_all_poses(seed):
    case = pose_case(seed)
    assert case.inverses.classification.found.given == OTHER_JOINT_GIVEN[seed]
    assert not case.inverses.functions["ik"].role.searches
    assert lost(case, case.answers) == 0


@pytest.mark.parametrize("seed", SEARCHED)
def test_incomplete_inverse_is_marked_for_numeric_search(seed):
    case = pose_case(seed)
    assert case.inverses.functions["ik"].role.searches
    assert lost(case, case.answers) > 0
    assert lost(case, case.refined) == 0


@pytest.mark.parametrize("seed", SEARCHED)
def test_numeric_search_keeps_fixed_joint_values(seed):
    case = pose_case(seed)
    role = case.inverses.functions["ik"].role
    for chosen, poses in sets(case, np.random.default_rng(seed)):
        found, bare = chosen.refined(poses.q), chosen.answers(poses.q)
        given = found.q[..., list(role.fixed)]
        assert (given == bare.q[..., list(role.fixed)]).all()


def test_shipped_serial_robots_need_no_numeric_search():
    """Shipped serial robots need no slow search, because their IK functions miss no pose.

    ``python -m bench inverse`` tests robot poses at joint angles that are multiples of 90 degrees.
    """
    functions = [f for name in NAMES for f in chasles.load(name).manifest.functions]
    solved = [f for f in functions if f.role.name == "inverse"]
    assert len(solved) >= 12
    assert not any(f.role.searches for f in solved)


def test_numeric_arm_pose_matches_product_of_exponentials():
    rng = np.random.default_rng(0)
    checked = 0
    for seed in range(8):
        robot = random_arm(seed)
        terms = Terms({p.symbol: p.value for p in robot.parameters})
        arm = NumericArm.of(robot, Lines(terms, axes_of(robot, terms)))
        q = rng.uniform(-3, 3, (5, len(robot.coordinates)))
        T, _ = arm.pose_jacobian(q)
        np.testing.assert_allclose(T, screws_of(robot).fk(q), atol=1e-12)
        checked += 1
    assert checked == 8


@pytest.mark.parametrize("seed", SEARCHED)
def test_estimate_of_unsolved_poses_matches_their_count(seed):
    """Independent code counts the poses for which the IK function finds no solution.

    For some poses, rounding decides whether a solution is found.
    """
    case = pose_case(seed)
    arm = NumericArm.of(case.described, case.inverses.classification.lines)
    q = configurations(arm, ())
    expected = judged(case, PoseSet("right angles", q), case.answers).unfound
    assert expected > 10
    assert expected / 4 < lost_poses(arm, case.inverses.functions["ik"]) < expected * 4


def test_target_components_match_task_targets():
    T = screws_of(random_arm(5)).fk(np.random.default_rng(1).uniform(-3, 3, (200, 8)))
    for task, components in {
        "ik_position": ("position",),
        "ik_position_pitch": ("position", "pitch"),
        "ik_position_direction": ("position", "direction"),
        "ik_planar": ("plane", "heading"),
    }.items():
        found = np.concatenate([TARGETS[component](T) for component in components], axis=1)
        np.testing.assert_allclose(found, TASKS[task].target(T), atol=1e-15)
