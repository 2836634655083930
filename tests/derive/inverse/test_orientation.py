"""Inverse kinematics of the orientation task, and of arms with three revolute joints."""

import random

import numpy as np
import pytest

import chasles
from chasles.derive import derive, explain, read, read_text, write
from chasles.derive.inverse.chosen_joints import inverses_for_fixed
from chasles.derive.inverse.families import FAMILIES
from chasles.derive.terms.terms import Terms
from chasles.errors import DerivationError, InputTypeError, InputValueError
from tests.support.compiling import compiled, loaded
from tests.support.generators.arms_with_slides import decoupled
from tests.support.generators.drawn_arms import Derived, cases_of
from tests.support.generators.poses import PoseSet
from tests.support.generators.synthetic import robot_of
from tests.support.oracles.verdict import counts, judged, newton

POSES, COUNTED = 200, 2
STARTS = 60
"""Number of random starts of Newton's method. A target orientation has one or two solutions."""
FUNCTIONS = ["fk", "fk_jacobian_mixed", "ik", "ik_orientation"]
PAN = """
name = "pan"
convention = "urdf"
units = { length = "mm", angle = "deg" }
joints = [
  { name = "pan", axis = [0, 0, 1] },
  { name = "tilt", xyz = [20, 0, 80], axis = [0, 1, 0] },
  { name = "roll", xyz = [60, 10, 15], axis = [1, 0, 0] },
]
"""


def orientation_case(seed: int) -> Derived:
    """Derive the orientation inverse of a random arm with three free revolute joints."""
    draw = random.Random(seed)
    kinds = draw.choice(("RRR", "RRR", "RRRP", "PRRR", "RPRR", "RRPRP"))
    arm = decoupled(kinds, 2 + seed)
    found = inverses_for_fixed(arm, Terms({}), FAMILIES, ())
    free = found.functions["ik_orientation"].role.free
    return Derived(kinds, "ik_orientation", free=free, described=arm, inverses=found)


def fixed_case(seed: int) -> Derived:
    """Derive the orientation inverse of a random six-joint arm with three fixed joints."""
    draw = random.Random(seed)
    rows = [
        f'{{ name = "j{k}", xyz = {[draw.randint(-300, 300) for _ in range(3)]}, '
        f"axis = {[draw.randint(-9, 9) for _ in range(2)] + [draw.randint(1, 9)]} }}"
        for k in range(6)
    ]
    head = 'name = "six"\nconvention = "urdf"\nunits = { length = "mm", angle = "deg" }\n'
    arm = read_text(f"{head}joints = [{', '.join(rows)}]")
    names = sorted(draw.sample([f"j{k}" for k in range(6)], 3))
    found = inverses_for_fixed(arm, Terms({}), FAMILIES, names)
    return Derived(f"six, {names}", "ik_orientation", described=arm, inverses=found)


def check(case: Derived, seed: int) -> None:
    rng = np.random.default_rng(seed)
    q = case.random(rng, POSES)
    q[:, list(case.free)] = 0.0
    verdict = judged(case, PoseSet("random", q, regular=True), case.answers)
    assert (verdict.missed, verdict.wrong, verdict.lost) == (0, 0, 0), case.name
    few = q[:COUNTED]
    expected = [len(newton(case, row, rng, STARTS)) for row in few]
    assert counts(case, case.answers(few)).tolist() == expected, case.name


def test_orientation_of_random_arm_is_complete():
    check(orientation_case(0), 0)


def test_orientation_with_fixed_joints_is_complete():
    check(fixed_case(1), 1)


def test_whole_pose_of_three_skew_joints_is_complete():
    (case,) = (case for case in cases_of(decoupled("RRR", 3)) if case.function == "ik")
    assert case.inverses.classification.found.title == "three joints that orient the tool"
    check(case, 3)


@pytest.fixture(scope="module")
def pan(tmp_path_factory):
    return compiled(read_text(PAN), tmp_path_factory.mktemp("pan"), FUNCTIONS, ["c"])


def test_camera_head_has_two_solutions_for_an_orientation(pan):
    q = np.array([0.3, 0.4, 0.5])
    found = pan.ik_orientation(pan.fk(q)[:3, :3])
    assert found.valid.all()
    other = [q[0] - np.pi, np.pi - q[1], q[2] - np.pi]
    np.testing.assert_allclose(found.q, [q, other], atol=1e-12)
    assert pan.ik(pan.fk(q)).valid.tolist() == [True, False]
    np.testing.assert_allclose(pan.ik(pan.fk(q)).q[0], q, atol=1e-12)


def test_orientation_is_a_task_of_nearest_and_path(pan):
    q = np.array([0.3, 0.4, 0.5])
    for target in (pan.fk(q), pan.fk(q)[:3, :3]):
        found = pan.ik_nearest(target, q + 0.1, task="orientation")
        np.testing.assert_allclose(found.q, q, atol=1e-12)
    way = q + np.linspace(0, 0.5, 20)[:, None]
    path = pan.ik_path(pan.fk(way), q, task="orientation")
    assert path.complete
    np.testing.assert_allclose(path.q, way, atol=1e-12)
    np.testing.assert_allclose(pan.ik_path(pan.fk(way)[:, :3, :3], q, task="orientation").q, way)


def test_orientation_out_of_reach_has_negative_margin(tmp_path):
    text = PAN.replace("axis = [0, 1, 0]", "axis = [0, 3, 4]")
    narrow = compiled(read_text(text), tmp_path, FUNCTIONS, ["c"])
    R = np.diag([-1.0, -1.0, 1.0]) @ chasles.so3.exp([0.0, -np.pi / 2, 0.0])
    found = narrow.ik_orientation(R)
    assert not found.valid.any()
    assert (found.margin < 0).all()


def test_arm_with_more_joints_needs_fixed_joints():
    arm = chasles.load("ur5e")
    q = arm.random_q(rng=5)
    names = arm.coordinate_names
    fixed = {names[k]: q[k] for k in (0, 1, 2)}
    found = arm.ik_orientation(arm.fk(q)[:3, :3], fixed=fixed)
    gaps = np.abs(np.exp(1j * found.q) - np.exp(1j * q)).max(-1)
    assert found.valid.all()
    assert gaps.min() <= 1e-12
    with pytest.raises(InputValueError, match="expected 3 free revolute joints"):
        arm.ik_orientation(np.eye(3), fixed={"elbow": 1.0})
    with pytest.raises(InputValueError, match="unknown joint 'elbo'"):
        arm.ik_orientation(np.eye(3), fixed={"elbo": 1.0})
    with pytest.raises(InputTypeError, match="fixed must map joint names to values"):
        arm.ik_orientation(np.eye(3), fixed=["elbow"])
    parallel = {names[k]: q[k] for k in (0, 4, 5)}
    with pytest.raises(DerivationError, match="has no function ik_orientation"):
        arm.ik_orientation(np.eye(3), fixed=parallel)


def test_parallel_neighbors_have_no_orientation_task():
    assert "ik_orientation" not in derive(read("scara")).inverse.functions
    arm = read_text(PAN.replace("axis = [1, 0, 0]", "axis = [0, 1, 0]"))
    assert "ik_orientation" not in explain(arm).inverses.functions


SMALL = {
    "R=R/R": "two parallel axes and a third axis",
    "R/R/R/R": "three joints and a revolute wrist joint",
    "R=R/R=R": "three joints and a revolute wrist joint",
}


@pytest.mark.parametrize(("chain", "title"), SMALL.items())
def test_whole_pose_of_small_arms_is_complete(chain, title):
    (case,) = (case for case in cases_of(robot_of(chain, seed=1)) if case.function == "ik")
    assert case.inverses.classification.found.family.title == title
    check(case, 1)


def test_fixed_joints_of_longer_arms_leave_a_small_arm(tmp_path):
    for fixed in (("elbow", "wrist_1"), ("shoulder_lift", "elbow", "wrist_3")):
        folder = tmp_path / fixed[0]
        write(read("ur5e"), folder, functions=FUNCTIONS[:3], fixed=fixed, languages=("c",))
        arm = loaded(folder)
        q = arm.random_q(rng=7)
        values = {name: q[arm.coordinate_names.index(name)] for name in fixed}
        found = arm.ik(arm.fk(q), fixed=values)
        gaps = np.abs(np.exp(1j * found.q[found.valid]) - np.exp(1j * q)).max(-1)
        assert gaps.min() <= 1e-9
