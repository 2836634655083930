"""The test campaign ``field`` writes correct URDF files and detects wrong inverse kinematics."""

import numpy as np
import pytest

from chasles.derive import read
from tests.campaigns import field
from tests.campaigns.field import judgement, own
from tests.support.compiling import compiled
from tests.support.generators.field_arms import (
    FieldCase,
    arms,
    calibrated,
    from_ssik,
    prebuilt,
)
from tests.support.generators.poses import PoseSet
from tests.support.oracles.screws import screws_of
from tests.support.oracles.verdict import judged
from tests.support.peers.interface import Answers

POSES = 40
FUNCTIONS = ["fk", "jacobian_mixed", "ik"]
"""Robot functions that the test campaign ``field`` needs."""
C_ALONE = ("c", "python")


def test_field_contains_all_ssik_arms_and_calibrated_arm():
    pytest.importorskip("ssik")
    names = [arm.name for arm in arms()]
    assert len(names) == len(set(names)) == 73
    assert "universal_robots_ur5_calibrated" in names


@pytest.mark.parametrize("name", ["kuka_iiwa14", "kinova_gen3", "fanuc_crx3ia"])
def test_written_urdf_matches_ssik_fk(name, tmp_path):
    pytest.importorskip("ssik")
    module = prebuilt()[name]
    arm = from_ssik(module)
    path = tmp_path / "arm.urdf"
    path.write_text(arm.urdf(), encoding="utf-8")
    q = np.random.default_rng(0).uniform(-np.pi, np.pi, (20, len(arm.axes)))
    theirs = np.array([module.fk(row) for row in q])
    np.testing.assert_allclose(arm.screws.fk(q), theirs, atol=1e-14)
    np.testing.assert_allclose(screws_of(read(path)).fk(q), theirs, atol=1e-13)


def test_judge_accepts_noisy_arm_and_detects_shifted_answers(tmp_path, monkeypatch):
    pytest.importorskip("ssik")

    def derived(arm, folder):
        path = folder / f"{arm.name}.urdf"
        path.write_text(arm.urdf(), encoding="utf-8")
        compiled(read(path), folder / arm.name, FUNCTIONS, C_ALONE)

    monkeypatch.setattr(field, "derived", derived)
    arm = from_ssik(prebuilt()["universal_robots_ur5"])
    outcome = judgement(arm, tmp_path, POSES, POSES // 2, 0)
    assert outcome.failures == ()
    assert outcome.counts["poses"] == POSES + POSES // 2
    case = FieldCase(arm.name, arm=arm, folder=tmp_path / arm.name)
    q = np.random.default_rng(1).uniform(-np.pi, np.pi, (POSES, 6))

    def shifted(asked):
        found = own(case, asked)
        return Answers(found.q + 1e-6, found.claimed)

    verdict = judged(case, PoseSet("random", q, regular=True), shifted)
    assert verdict.wrong == verdict.missed == POSES


def test_underivable_arm_is_reported(tmp_path):
    arm = calibrated()
    broken = type(arm)("broken", arm.before * np.nan, arm.axes, arm.after)
    (failure,) = judgement(broken, tmp_path, POSES, POSES, 0).failures
    assert failure.startswith("broken: not derived: ")


def test_double_solutions_at_right_angles_occupy_single_slot(tmp_path):
    """Without refinement, the inverse kinematics returns a double solution several times.

    Six-joint arms have an even number of solutions.
    """
    pytest.importorskip("ssik")
    arm = from_ssik(prebuilt()["fanuc_crx3ia"])
    path = tmp_path / "arm.urdf"
    path.write_text(arm.urdf(), encoding="utf-8")
    robot = compiled(read(path), tmp_path / "arm", ["fk", "ik"], C_ALONE)
    q = np.pi / 2 * np.random.default_rng(0).integers(-1, 3, (200, 6))
    count = robot.ik(arm.screws.fk(q)).count
    assert (count % 2 == 0).all()
    assert np.unique(count).size > 5
