"""The inverse of an arm with geometry errors misses no solution near its wrist singularity."""

import numpy as np
import pytest

from chasles.derive.inverse.general.elimination_choice import choice_at, slides_of
from chasles.derive.inverse.general.raghavan_roth import numbers
from chasles.derive.inverse.nominal_convergence import Sampled
from chasles.derive.inverse.serial_inverse import inverses
from chasles.derive.model.tolerances import SEPARATE
from chasles.derive.terms.terms import Terms
from tests.campaigns.general import Judged
from tests.support.compiling import compiled
from tests.support.displaced_arm import SIZE, near_wrist
from tests.support.generators.drawn_arms import random_arm
from tests.support.generators.geometric_errors import displaced
from tests.support.oracles.pinocchio_fk import pinocchio_fk

FUNCTIONS = ("fk", "fk_jacobian_mixed", "ik")
TRUE = 1e-8
"""Maximum pose error (meter, or rotation matrix entry) of a correct solution."""
POSES = 1000
MANY = (1642, 8294, 18743, 23186, 28494, 49618, 51143, 58974, 59465)
"""Indices of configurations near the wrist singularity whose poses have over twelve solutions.

The configurations are selected from 60,000 samples.
"""
RANDOM, MAX_LOST = 30_000, 5e-5
"""Number of random configurations, and fraction of these configurations that may be missed near
singularities."""
REGULAR, NEARLY_SINGULAR = 2e-4, 5e-3
"""Range of the smallest singular value (meter or radian per radian) of the configurations in
these tests."""


@pytest.fixture
def robot(displaced_robot):
    return displaced_robot


@pytest.fixture
def arm(displaced_arm):
    return displaced_arm


def test_solutions_without_nominal_counterpart_are_found(arm, robot):
    q = near_wrist(POSES, 0)
    T = arm.fk(q)
    found = arm.ik(T)
    held = (found.valid & (np.abs(found.distances_from(q)).max(-1) < 1e-6)).any(-1)
    assert held.mean() > 0.9999
    assert (found.count > 8).mean() > 0.01
    assert found.q.shape == (POSES, 16, 6)
    fk = pinocchio_fk(robot)
    for k in np.flatnonzero(found.count > 8)[:20]:
        for row in found.q[k][found.valid[k]]:
            assert np.abs(fk(row) - T[k]).max() < TRUE


def test_nominal_residual_of_reachable_poses_is_bounded(arm):
    """The residual bound of the nominal arm's solutions also holds near singularities.

    A pose whose nominal residual exceeds this bound is out of reach.
    """
    q = near_wrist(POSES, 4)
    stretched = -np.arctan2(0.302, 0.07)
    q[: POSES // 2, 2] = stretched + np.random.default_rng(5).normal(scale=0.01, size=POSES // 2)
    T = arm.fk(q)
    assert arm.ik(T).valid.any(axis=-1).all()
    _, residual, _ = arm.functions["ik_nominal"](T)
    assert np.nanmin(residual, axis=-1).max() < 3 * SIZE


def test_far_unreachable_pose_returns_nominal_arm_answers(arm):
    rng = np.random.default_rng(6)
    T = arm.fk(rng.uniform(-np.pi, np.pi, (500, 6)))
    T[:, :3, 3] *= (rng.uniform(1.5, 4, 500) / np.linalg.norm(T[:, :3, 3], axis=-1))[:, None]
    found = arm.ik(T)
    q, _, margin = arm.functions["ik_nominal"](T)
    assert not found.valid.any()
    held = np.isfinite(q).all(-1)
    assert held.all()
    np.testing.assert_array_equal(found.q[:, :8], q)
    np.testing.assert_array_equal(found.margin[:, :8], margin)
    apart = np.linalg.norm((arm.fk(q) - T[:, None])[..., :3, 3], axis=-1)
    assert (found.residual[:, :8] >= apart * (1 - 1e-12)).all()
    assert np.isnan(found.residual[:, 8:]).all()


def test_poses_with_over_twelve_solutions_include_configuration(arm):
    """Some poses have sixteen solutions, which is the maximum for six revolute joints."""
    q = near_wrist(60_000, 2)[list(MANY)]
    T = arm.fk(q)
    found = arm.ik(T)
    assert (found.count > 12).all()
    assert found.count.max() == 16
    owners = np.repeat(T, found.count, 0)
    assert np.abs(arm.fk(found.q[found.valid]) - owners).max() < TRUE
    np.testing.assert_array_equal(found.distinct().count, found.count)
    held = (found.valid & (np.abs(found.distances_from(q)).max(-1) < 1e-6)).any(-1)
    assert held.all()


def test_few_configurations_are_missed_near_singularities(arm):
    """Most missed configurations are near singularities."""
    q = np.random.default_rng(3).uniform(-np.pi, np.pi, (RANDOM, arm.n))
    T, J = arm.fk_jacobian_mixed(q)
    least = np.linalg.svd(J, compute_uv=False)[:, -1]
    near = (least > REGULAR) & (least < NEARLY_SINGULAR)
    assert near.sum() > 1000
    found = arm.ik(T[near])
    held = (found.valid & (np.abs(found.distances_from(q[near])).max(-1) < 1e-6)).any(-1)
    assert (~held).sum() <= MAX_LOST * RANDOM


def test_arm_with_fixed_joints_misses_no_configuration(tmp_path):
    robot, half = displaced(random_arm(100), 4e-3, 100), 100
    arm = compiled(robot, tmp_path / robot.name, FUNCTIONS, ["c"])
    rng = np.random.default_rng(7)
    q = rng.uniform(-np.pi, np.pi, (2 * half, arm.n))
    q[half:] = np.pi / 2 * rng.integers(-1, 3, (half, arm.n))
    for k in slides_of(robot):
        q[:, k] = rng.uniform(-0.5, 0.5, len(q))
    regular, *lost_none_wrong = Judged(robot, arm).lost(q)
    assert regular > 1.5 * half
    assert lost_none_wrong == [0, 0, 0]


def test_split_joints_separate_the_solutions(robot):
    found = inverses(robot, Terms({}))
    nominal = found.solved["ik_nominal"].function
    apart = Sampled.of(robot, found.classification.lines, nominal).separations
    assert max(apart[:3]) < 1e-6 < SEPARATE < min(apart[3:])
    joints = [order.joints[2] for order in choice_at(numbers(robot), apart=apart).orders]
    assert sorted(joints[:3]) == [3, 4, 5]
    without = [order.joints[2] for order in choice_at(numbers(robot)).orders]
    assert without != joints
