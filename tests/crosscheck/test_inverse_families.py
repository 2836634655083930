"""Each closed-form inverse family agrees with independent forward kinematics on random arms.

The command ``make campaign ONLY=structures`` tests more arms of each axis structure.
"""

import re
from functools import cache
from itertools import product

import numpy as np
import pytest

from chasles.derive.inverse.classify import classify
from chasles.derive.inverse.given_joints import joint_sets_to_fix
from chasles.derive.terms.terms import Terms
from tests.support.fixed import fixed_at
from tests.support.generators.poses import Case, PoseSet, nearly, right_angles
from tests.support.generators.synthetic import Arm, robot_of
from tests.support.oracles.tasks import wrapped
from tests.support.oracles.verdict import SAME, VALID, judged, newton
from tests.support.tolerances import WORST_INVERSE

RANDOM = 100
GRID = 30
TARGETS = 1
"""Number of targets for which multi-start Newton iteration counts the solutions."""
STARTS = 60
PATHS, STEPS = 4, 300
WRIST = "/RxrxR"
ARMS = {
    "R=R/R": "axes 1 and 2 are parallel",
    "R/R=R": "axes 2 and 3 are parallel",
    "RxR/R": "axes 1 and 2 intersect",
    "R/RxR": "axes 2 and 3 intersect",
    "R/R/R": "joints 1, 2 and 3 are revolute",
    "RxR/P": "axes 1 and 2 intersect, and joint 3 is prismatic",
    "R=R=P": "axes 1 and 2 are parallel and not perpendicular to prismatic joint 3",
    "R/RLP": "joint 3 is prismatic and perpendicular to axis 2",
    "P=R=R": "axes 2 and 3 are parallel and not perpendicular to prismatic joint 1",
    "P/RxR": "joint 1 is prismatic, and axes 2 and 3 intersect",
    "P/P/R": "joints 1 and 2 are prismatic, and joint 3 is revolute",
    "P/P/P": "joints 1, 2 and 3 are prismatic",
}
"""Structures of the first three joints of arms with a spherical wrist."""
UR = "three parallel axes 2, 3, 4 and intersecting axes 5, 6"
FOREARM = "three parallel axes 2, 3, 4"
INNER = "axes 2, 3 and 4 that intersect in one point"
COLUMN = "a revolute column, two prismatic joints and a wrist with axis 4 parallel to the column"
SWIVEL = "spherical shoulder and spherical wrist"
TURNTABLE = "a turntable with three parallel axes"
FAMILIES = {
    "R/R=R=R/RxR": UR,
    "R/R=R=R/R/R": FOREARM,
    "R/RxrxR/R/R": INNER,
    "RLpLP=R/RxR": COLUMN,
}
SEVEN = ("RxrxRLrLRxrxR", "RxrxR/R/RxrxR", "RxrxRxRxRxrxR")
"""Seven-joint arms with a planar elbow, with an elbow offset along the elbow axis, and with an
elbow of three concurrent axes."""
PLANE = ("R=R=R", "R=R=R=P", "R=R=P=R", "R=P=R=R", "P=R=R=R")
WRISTED = {"R/R=R": False, "R=R=P": True, "P=R=R": True}
"""Structures of arms with a spherical wrist. The flag of a structure is True if its skew axes are
at right angles.

The position problem of these arms is a quadratic equation. Two structures of three joints have no
position inverse kinematics function. The position inverse kinematics function is tested for every
structure that has this function. Some structures with the function `ik_position` lead to a quartic
equation.
"""
EVERYWHERE = [
    *((arm + WRIST, "spherical wrist", right) for arm, right in WRISTED.items()),
    *((chain, title, title == COLUMN) for chain, title in FAMILIES.items()),
    *((chain, SWIVEL, right) for chain, right in zip(SEVEN, (False, True, True), strict=True)),
    *((chain, "parallel axes", True) for chain in PLANE),
]
BACKWARDS = [("R/RxR/RxrxR"[::-1], True), ("RLpLP=R/RxR"[::-1], False)]


@cache
def _arm(chain, function, right):
    return Arm(chain, function, right=right)


def arm_of(chain, function="ik", *, right=False):
    """Derive the inverse of an arm.

    Calls with positional and with keyword arguments share one cached result.
    """
    return _arm(chain, function, right)


def some(arm, count, seed=1):
    return arm.random(np.random.default_rng(seed), count)


def assert_nothing_is_missed(arm, grid=True):
    """Assert that no solution is missed or wrong."""
    found = judged(arm, PoseSet("random", some(arm, RANDOM), regular=True), arm.answers)
    assert (found.missed, found.wrong, found.lost) == (0, 0, 0)
    assert found.worst <= WORST_INVERSE
    rng = np.random.default_rng(3)
    at = right_angles(arm, rng)
    at = at[rng.permutation(len(at))[:GRID]]
    for q in (at, nearly(arm, rng, at)) if grid else ():
        found = judged(arm, PoseSet("right angles", q), arm.answers)
        assert (found.missed, found.wrong) == (0, 0)


def assert_complete(arm):
    """Assert that the inverse kinematics function returns every solution of Newton's method."""
    rng = np.random.default_rng(2)
    for row, found in zip(q := some(arm, TARGETS), arm.answers(q).q, strict=True):
        expected = newton(arm, row, rng, STARTS)
        assert len(expected) >= 1
        far = np.where(arm.turns, wrapped(difference := expected[:, None] - found), difference)
        assert np.abs(far).max(axis=-1).min(axis=-1).max() < SAME


@pytest.mark.parametrize(("chain", "title", "right"), EVERYWHERE)
def test_inverse_family_misses_no_solution(chain, title, right):
    arm = arm_of(chain, right=right)
    assert arm.inverses.classification.found.title == title
    assert_nothing_is_missed(arm)
    if not right:
        assert_complete(arm)


@pytest.mark.parametrize(("chain", "right"), BACKWARDS)
def test_reversed_chain_inverse_misses_no_solution(chain, right):
    arm = arm_of(chain, right=right)
    assert arm.inverses.classification.found.backwards
    assert_nothing_is_missed(arm)


@pytest.mark.parametrize("chain", [chain for chain in ARMS if chain not in ("R=R=P", "P=R=R")])
def test_three_joint_position_inverse_is_complete(chain):
    arm = arm_of(chain, "ik_position")
    if "P" in chain:
        # Arms with three revolute joints are also classified for the orientation task, so only arms
        # with a prismatic joint are checked here.
        structure, moves = arm.inverses.classification.found.requirements
        names = [axis.name for axis in arm.inverses.classification.lines.axes]
        expected = re.sub(r"\d", lambda number: names[int(number[0]) - 1], ARMS[chain])
        assert structure.text == expected
        assert moves.deviation == 0
    assert_nothing_is_missed(arm)
    assert_complete(arm)


@pytest.mark.parametrize("chain", ["R/R=R=R/R/R", "R/RxrxR/R/R"])
def test_slot_sign_stays_constant_between_singularities(chain):
    arm = arm_of(chain)
    rng = np.random.default_rng(1)
    s = np.linspace(0, 1, STEPS)[:, None]
    followed = 0
    for _ in range(PATHS):
        waves = rng.normal(size=(3, arm.robot.n))
        bend = sum(wave * np.sin((k + 1) * np.pi * s / 2) for k, wave in enumerate(waves))
        q = rng.uniform(-np.pi, np.pi, arm.robot.n) + bend
        found = arm.found(q)
        far = np.abs(wrapped(found.q - q[:, None])).max(axis=-1)
        slot = np.where(found.valid, far, np.inf).argmin(axis=1)
        known = far.min(axis=1) < 1e-6
        second = slot // 2 % 2
        same = np.sign(np.linalg.det(arm.jacobian(q)))
        steady = known[1:] & known[:-1] & (same[1:] == same[:-1])
        followed += steady.sum()
        assert (second[1:] == second[:-1])[steady].all()
    assert followed > 0.9 * PATHS * STEPS


def test_inverse_with_fixed_joint_is_complete():
    arm = arm_of("P/R/R=R/RxrxR")
    assert len(arm.inverses.classification.found.given) == 1
    assert_nothing_is_missed(arm)
    assert_complete(arm)


@pytest.mark.parametrize("chain", ["R+R=R=R", "R=R=RLR"])
def test_arm_with_fewer_joints_solves_its_reachable_poses(chain):
    arm = arm_of(chain)
    assert arm.inverses.classification.found.title.startswith(TURNTABLE)
    found = judged(arm, PoseSet("random", some(arm, RANDOM), regular=True), arm.answers)
    assert (found.missed, found.wrong, found.lost) == (0, 0, 0)
    assert_complete(arm)


@pytest.mark.parametrize("chain", ["R/R=R/RxrxR", "R/R=R=R/RxR", "RxrxRLrLRxrxR"])
def test_unreachable_targets_give_finite_invalid_answers(chain):
    arm = arm_of(chain)
    q = some(arm, 200)
    T = arm.targets(q)
    T[:, :3, 3] += np.random.default_rng(4).normal(size=(200, 3)) * 1e3
    found = arm.robot.functions["ik"](T, *arm.others(q))
    assert np.isfinite(found.q).all()
    assert np.isfinite(found.residual).all()
    assert not found.valid.any()
    assert (found.margin < 0).all()
    T[:, 0, 3] = np.nan
    assert not arm.robot.functions["ik"](T, *arm.others(q)).valid.any()


def test_inner_revolute_joints_cannot_be_fixed():
    lines = classify_of("R/R=R/RxrxR/R").lines
    ends = [k for k in range(7) if (k,) in joint_sets_to_fix(lines, 1)]
    assert ends == [0, 6]
    assert joint_sets_to_fix(lines, 2) == {(0, 1), (0, 6), (5, 6)}
    with_slide = classify_of("P/R/R=R/RxrxR").lines
    assert (0,) in joint_sets_to_fix(with_slide, 1)


@pytest.mark.parametrize(
    ("chain", "asked"),
    [
        ("R/R/R/R/R/R", "pass through one point"),
        ("R/R/P/R/R/R", "off by"),
        ("R/R/R/R/R", "are parallel"),
        ("P/R/P/R/P", "but j1, j3, j5 are prismatic"),
    ],
)
def test_arm_without_closed_form_names_missing_condition(chain, asked):
    classification = classify_of(chain)
    assert classification.found is None
    assert "the nearest structure is" in classification.missing
    assert asked in classification.missing or asked == "no structure"


def test_arm_without_elbow_needs_fixed_joint():
    arm = arm_of("RxrxR=R/RxrxR")
    assert len(arm.inverses.classification.found.given) == 1
    assert_nothing_is_missed(arm)


def test_redundant_planar_arm_fixes_its_last_joint():
    classification = classify_of("R=R=R=R")
    assert classification.found.given == (3,)
    assert list(Arm("R=R=R=R").inverses.functions) == ["ik"]


def test_reversed_turntable_offers_only_pose_inverse():
    assert list(Arm("R=R=RLR").inverses.functions) == ["ik"]


def classify_of(chain):
    robot = robot_of(chain)
    return classify(robot, Terms({}))


HYBRID = ("well_manipulator", "delta", "excavator", "five_bar", "four_bar")


@pytest.mark.parametrize("name", HYBRID)
def test_loop_robot_ik_recovers_generating_configuration(name):
    case = Case(name)
    q = some(case, 100)
    T = case.pose(q)
    found = case.robot.ik(T, fixed=fixed_at(case.robot, q))
    closed = np.isfinite(found.q).all(axis=-1)
    closed[closed] = case.robot.loops_close(found.q[closed])
    assert not (found.valid & ~closed).any()
    errors = np.full(closed.shape, np.inf)
    errors[closed] = case.error(found.q[closed], np.repeat(T[:, None], closed.shape[1], 1)[closed])
    assert errors[found.valid].max() <= VALID
    assert found.valid.any(axis=1).all()
    gap = found.q - q[:, None]
    far = np.where(case.turns, wrapped(gap), gap)
    own = np.where(found.valid, np.abs(far).max(axis=-1), np.inf).min(axis=1)
    assert own.max() < SAME


@pytest.mark.parametrize("name", HYBRID)
def test_loop_robot_marks_unreachable_poses_invalid(name):
    case = Case(name)
    q = some(case, 200)
    for by in (1.5, 1e3):
        T = case.pose(q)
        T[:, :3, 3] += by
        assert not case.robot.ik(T, fixed=fixed_at(case.robot, q)).valid.any()


@pytest.mark.parametrize("chain", ["R=R=R=P", "R=R=R", "R+R=R=R", "R/R=R/RxrxR", "R/R=R=R/RxR"])
def test_nan_target_has_no_valid_solution(chain):
    arm = arm_of(chain)
    for row, column in product(range(3), range(4)):
        T = arm.targets(some(arm, 10))
        T[:, row, column] = np.nan
        assert not arm.robot.functions["ik"](T).valid.any(), (row, column)


@pytest.mark.parametrize("by", [1e-6, 1e-4, 1e-3])
@pytest.mark.parametrize("moved", [False, True])
def test_residual_equals_remaining_distance_or_angle(by, moved):
    """A planar arm cannot reach a target that is tilted or lifted out of its plane."""
    arm = arm_of("R=R=R")
    T = arm.targets(some(arm, 100))
    if moved:
        T[:, :3, 3] += by * arm.screws.axes[0]
    else:
        c, s = np.cos(by), np.sin(by)
        T[:, :3, :3] = T[:, :3, :3] @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    found = arm.robot.functions["ik"](T)
    left = arm.error(found.q, np.repeat(T[:, None], found.q.shape[1], axis=1))
    assert not found.valid.any()
    assert left.min() >= 0.9 * by
    np.testing.assert_allclose(found.residual, left, rtol=1e-6)
