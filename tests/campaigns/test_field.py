"""Arms of the field: their URDFs are the arms, and the judge finds what an inverse does wrong."""

import numpy as np
import pytest

from chasles.derive import from_urdf
from tests.campaigns import field as benchmark
from tests.support.compiling import compiled
from tests.support.generators.field_arms import (
    FieldCase,
    arms,
    calibrated,
    derived,
    from_ssik,
    prebuilt,
)
from tests.support.generators.poses import PoseSet
from tests.support.oracles.screws import screws_of
from tests.support.oracles.verdict import judged
from tests.support.peers.interface import Answers

POSES = 40


def test_all_arms_of_the_wheel_and_the_calibrated_one_are_there():
    pytest.importorskip("ssik")
    names = [arm.name for arm in arms()]
    assert len(names) == len(set(names)) == 73
    assert "universal_robots_ur5_calibrated" in names


@pytest.mark.parametrize("name", ["kuka_iiwa14", "kinova_gen3", "fanuc_crx3ia"])
def test_a_urdf_is_the_arm_of_the_module(name, tmp_path):
    pytest.importorskip("ssik")
    module = prebuilt()[name]
    arm = from_ssik(module)
    path = tmp_path / "arm.urdf"
    path.write_text(arm.urdf(), encoding="utf-8")
    q = np.random.default_rng(0).uniform(-np.pi, np.pi, (20, len(arm.axes)))
    theirs = np.array([module.fk(row) for row in q])
    np.testing.assert_allclose(arm.screws.fk(q), theirs, atol=1e-14)
    np.testing.assert_allclose(screws_of(from_urdf(path)).fk(q), theirs, atol=1e-13)


def test_the_calibrated_arm_is_judged(tmp_path):
    arm = calibrated()
    row = benchmark.judgement(arm, tmp_path, POSES, 0)
    assert row.holds
    assert row.random is not None
    assert row.random.poses == POSES
    case = FieldCase(arm.name, arm=arm, folder=tmp_path / arm.name)
    q = np.random.default_rng(1).uniform(-np.pi, np.pi, (POSES, 6))

    def shifted(asked):
        found = benchmark.own(case, asked)
        return Answers(found.q + 1e-6, found.claimed)

    verdict = judged(case, PoseSet("random", q, regular=True), shifted)
    assert verdict.wrong == verdict.missed == POSES


def test_an_arm_that_is_not_derived_is_said(tmp_path):
    arm = calibrated()
    broken = type(arm)("broken", arm.before * np.nan, arm.axes, arm.after)
    with pytest.raises(RuntimeError):
        derived(broken, tmp_path)
    assert benchmark.judgement(broken, tmp_path, POSES, 0).tier == "not derived"


def test_double_solutions_at_right_angles_stand_in_one_slot(tmp_path):
    """Solutions of six joints come in pairs; two that meet stand twice unless steps reach them."""
    pytest.importorskip("ssik")
    arm = from_ssik(prebuilt()["fanuc_crx3ia"])
    path = tmp_path / "arm.urdf"
    path.write_text(arm.urdf(), encoding="utf-8")
    robot = compiled(from_urdf(path), tmp_path / "arm", ["fk", "ik"])
    q = np.pi / 2 * np.random.default_rng(0).integers(-1, 3, (1000, 6))
    count = robot.ik(arm.screws.fk(q)).count
    assert (count % 2 == 0).all()
    assert np.unique(count).size > 5
