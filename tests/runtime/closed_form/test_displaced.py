"""An arm with errors of 4 mm and 4 mrad near its wrist's singularity: all solutions are found."""

import ctypes
import subprocess

import numpy as np
import pytest

from chasles.derive import load
from chasles.derive.inverse.general.raghavan_roth import numbers
from chasles.derive.inverse.general.split_choice import choice_at, slides_of
from chasles.derive.inverse.led import Sampled
from chasles.derive.inverse.serial_inverse import inverses
from chasles.derive.model.tolerances import SEPARATE
from chasles.derive.terms.terms import Terms
from tests.campaigns.general import Judged
from tests.support.compiling import FAST, compiled
from tests.support.derivations import description
from tests.support.generators.drawn_arms import random_arm
from tests.support.generators.geometric_errors import displaced
from tests.support.oracles.pinocchio_fk import pinocchio_fk

FUNCTIONS = ("fk", "fk_jacobian_mixed", "ik")
SIZE, SEED = 4e-3, 5
"""Errors (metre, radian) of the arm, and the seed of the errors."""
MANY, MANY_SEED = 3.6465829651e-3, 203
"""The same of an arm of which poses have up to sixteen solutions."""
WRIST = 4
FAR = 0.25
"""Radian: how far from its singularity the wrist is bent."""
TRUE = 1e-8
"""Error of a pose (metre, or entry of a rotation) above which a solution is wrong."""
POSES = 4000
RANDOM, MOST_LOST = 100_000, 5e-5
"""Random configurations, and the share of them that may be lost near singularities."""
REGULAR, NEARLY_SINGULAR = 2e-4, 5e-3
"""Least singular values (metre or radian per radian) between which solutions are looked for."""
SURE = """
int sure(const double *T)
{
  chasles_general_six six;
  chasles_general_found found;
  chasles_general_set(&NAME_ik_tables, NULL, &six);
  return chasles_general_by_splits(&six, T, &found);
}
"""


@pytest.fixture(scope="module")
def robot():
    return displaced(load(description("irb120")), SIZE, SEED)


@pytest.fixture(scope="module")
def arm(robot, tmp_path_factory):
    return compiled(robot, tmp_path_factory.mktemp("displaced") / robot.name, FUNCTIONS, flags=FAST)


def near_wrist(count, seed):
    """Configurations near the wrist's singularity."""
    rng = np.random.default_rng(seed)
    q = rng.uniform(-np.pi, np.pi, (count, 6))
    q[:, WRIST] = rng.uniform(-FAR, FAR, count) + np.pi * rng.integers(0, 2, count)
    return q


def test_solutions_without_nominal_counterpart_are_found(arm, robot):
    q = near_wrist(POSES, 0)
    T = arm.fk(q)
    found = arm.ik(T)
    held = (found.valid & (np.abs(found.moves_from(q)).max(-1) < 1e-6)).any(-1)
    assert held.mean() > 0.9999
    assert (found.count > 8).mean() > 0.01
    assert found.q.shape == (POSES, 16, 6)
    fk = pinocchio_fk(robot)
    for k in np.flatnonzero(found.count > 8)[:20]:
        for row in found.q[k][found.valid[k]]:
            assert np.abs(fk(row) - T[k]).max() < TRUE


def test_nominal_residual_of_reachable_poses_is_bounded(arm):
    """Also beside several singularities; so a pose that it misses by far is out of reach."""
    q = near_wrist(POSES, 4)
    stretched = -np.arctan2(0.302, 0.07)
    q[: POSES // 2, 2] = stretched + np.random.default_rng(5).normal(scale=0.01, size=POSES // 2)
    T = arm.fk(q)
    assert arm.ik(T).valid.any(axis=-1).all()
    _, residual, _ = arm.ik_nominal(T)
    assert np.nanmin(residual, axis=-1).max() < 3 * SIZE


def test_far_unreachable_pose_returns_nominal_arm_answers(arm):
    rng = np.random.default_rng(6)
    T = arm.fk(rng.uniform(-np.pi, np.pi, (500, 6)))
    T[:, :3, 3] *= (rng.uniform(1.5, 4, 500) / np.linalg.norm(T[:, :3, 3], axis=-1))[:, None]
    found = arm.ik(T)
    q, _, margin = arm.ik_nominal(T)
    assert not found.valid.any()
    held = np.isfinite(q).all(-1)
    assert held.all()
    np.testing.assert_array_equal(found.q[:, :8], q)
    np.testing.assert_array_equal(found.margin[:, :8], margin)
    apart = np.linalg.norm((arm.fk(q) - T[:, None])[..., :3, 3], axis=-1)
    assert (found.residual[:, :8] >= apart * (1 - 1e-12)).all()
    assert np.isnan(found.residual[:, 8:]).all()


def test_poses_with_over_twelve_solutions_include_configuration(tmp_path):
    """Some have sixteen, as many as six revolute joints may have."""
    robot = displaced(load(description("irb120")), MANY, MANY_SEED)
    arm = compiled(robot, tmp_path / robot.name, FUNCTIONS, flags=FAST)
    q = near_wrist(60_000, 2)
    found = arm.ik(arm.fk(q))
    many = found.count > 12
    assert many.sum() > 5
    T, solutions = arm.fk(q[many]), found.q[many][found.valid[many]]
    owners = np.repeat(T, found.count[many], 0)
    assert np.abs(arm.fk(solutions) - owners).max() < TRUE
    np.testing.assert_array_equal(found.distinct().count[many], found.count[many])
    held = (found.valid & (np.abs(found.moves_from(q)).max(-1) < 1e-6)).any(-1)
    assert held[many].all()


def test_few_configurations_are_missed_near_singularities(tmp_path):
    """With errors of 10 mm and mrad: of random configurations, most that are lost are there."""
    robot = displaced(load(description("irb6640")), 1e-2)
    arm = compiled(robot, tmp_path / robot.name, FUNCTIONS, flags=FAST)
    q = np.random.default_rng(3).uniform(-np.pi, np.pi, (RANDOM, arm.n))
    T, J = arm.fk_jacobian_mixed(q)
    least = np.linalg.svd(J, compute_uv=False)[:, -1]
    near = (least > REGULAR) & (least < NEARLY_SINGULAR)
    assert near.sum() > 2000
    found = arm.ik(T[near])
    held = (found.valid & (np.abs(found.moves_from(q[near])).max(-1) < 1e-6)).any(-1)
    assert (~held).sum() <= MOST_LOST * RANDOM


def drawn(number):
    """An arm of round numbers with errors: of these, two lost poses where a joint was given."""
    return displaced(random_arm(number), 4e-3, number)


def shown(name, size):
    return displaced(load(description(name)), size, 1)


@pytest.mark.parametrize(
    "robot",
    [
        *(shown("panda", 3e-3), shown("stanford", 3e-3), drawn(80), drawn(100)),
    ],
    ids=lambda robot: robot.title or robot.name,
)
def test_arms_with_fixed_or_prismatic_joints_miss_no_configuration(robot, tmp_path):
    """At random and at right angles, those at which the six other joints are singular left out."""
    arm = compiled(robot, tmp_path / robot.name, FUNCTIONS, flags=FAST)
    rng = np.random.default_rng(7)
    q = rng.uniform(-np.pi, np.pi, (2 * POSES, arm.n))
    q[POSES:] = np.pi / 2 * rng.integers(-1, 3, (POSES, arm.n))
    for k in slides_of(robot):
        q[:, k] = rng.uniform(-0.5, 0.5, len(q))
    regular, *lost_none_wrong = Judged(robot, arm).lost(q)
    assert regular > 1.5 * POSES
    assert lost_none_wrong == [0, 0, 0]


def test_general_solver_certifies_nearly_all_poses(arm, tmp_path):
    """The determinant of such an arm is tiny, and nevertheless known to ten digits."""
    source, library = tmp_path / "sure.c", tmp_path / "sure.so"
    name = arm.name
    source.write_text(f'#include "{arm.folder}/{name}.c"\n' + SURE.replace("NAME", name))
    command = ["cc", "-std=gnu99", "-O1", "-w", "-fPIC", "-shared", source, "-o", library, "-lm"]
    subprocess.run(command, check=True)
    sure = ctypes.CDLL(str(library)).sure
    poses = [np.ascontiguousarray(T) for T in arm.fk(near_wrist(300, 1))]
    told = [sure(T.ctypes.data_as(ctypes.c_void_p)) for T in poses]
    assert np.mean(told) > 0.98


def test_split_joints_separate_the_solutions(robot):
    """The solutions of a wrist share the joints before it, on which no split depends first."""
    found = inverses(robot, Terms({}))
    nominal = found.solved["ik_nominal"].function
    apart = Sampled.of(robot, found.classification.lines, nominal).separations
    assert max(apart[:3]) < 1e-6 < SEPARATE < min(apart[3:])
    joints = [split.joints[2] for split in choice_at(numbers(robot), apart=apart).splits]
    assert sorted(joints[:3]) == [3, 4, 5]
    without = [split.joints[2] for split in choice_at(numbers(robot)).splits]
    assert without != joints
