"""The inverse of planar platforms, computed leg by leg with all branches."""

import json
from pathlib import Path

import numpy as np
import pytest

import chasles
from tests.support.compiling import loaded
from tests.support.handwritten import planar

ROD = 0.13


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    folder = tmp_path_factory.mktemp("planar")
    return loaded(planar.write(folder / "planar", "13/100"))


def test_ik_planar_matches_published_angles(robot):
    expected = [
        (78.52393138, 0.16983617),
        (176.46904472, 88.26254206),
        (-29.82437852, -129.56592854),
    ]
    found = robot.ik_planar([0.02, 0.05, 0.0])
    q, residual, margin, valid = found
    assert (q.shape, valid.shape, margin.shape) == ((8, 3), (8,), (8,))
    assert (valid ^ found.other_mode).all()
    np.testing.assert_array_equal(residual == 0, valid)
    degrees = np.degrees(np.mod(q + np.pi, 2 * np.pi) - np.pi)
    for leg, pair in enumerate(expected):
        np.testing.assert_allclose(np.unique(degrees[:, leg].round(6)), sorted(np.round(pair, 6)))
    assert len({tuple(row) for row in degrees.round(6)}) == 8


def test_every_ik_planar_branch_reaches_pose(robot):
    rng = np.random.default_rng(0)
    pose = rng.uniform([-0.2, -0.2, -1.0], [0.2, 0.2, 1.0], (50, 40, 3))
    found = robot.ik_planar(pose)
    q, margin, valid = found.q, found.margin, found.valid | found.other_mode
    for side, slot in ((1.0, 0), (-1.0, 7)):
        expected = planar.cranks(pose, ROD, side)
        difference = np.mod(q[..., slot, :] - expected + np.pi, 2 * np.pi) - np.pi
        np.testing.assert_array_equal(valid[..., slot], np.isfinite(expected).all(-1))
        assert np.nanmax(np.abs(difference)) < 1e-7
    assert 0.05 < valid.mean() < 0.95
    held = np.broadcast_to(pose[..., None, :], q.shape)[valid]
    assert np.abs(robot.functions["rods"](held, q[valid])).max() < 1e-12
    assert np.isnan(q[~valid]).any(-1).all()
    assert (margin[valid] >= 0).all()
    apart = np.abs(robot.fk_planar_all(q[valid]).x - held[:, None]).max(-1)
    assert np.nanmin(apart, axis=-1).max() < 1e-7


def test_valid_ik_planar_slot_has_fk_at_pose():
    robot = chasles.load("planar_3rrr")
    rng = np.random.default_rng(0)
    pose = rng.uniform([-0.1, -0.1, -0.5], [0.1, 0.1, 0.5], (200, 3))
    found = robot.ik_planar(pose)
    T = robot.fk(found.q)
    reached = np.stack([T[..., 0, 3], T[..., 1, 3], np.arctan2(T[..., 1, 0], T[..., 0, 0])], -1)
    is_pose = np.abs(reached - pose[:, None]).max(-1) < 1e-7
    assert found.valid.any()
    assert found.other_mode.any()
    np.testing.assert_array_equal(found.valid, is_pose)


def test_ik_planar_exists_only_for_planar_chain(tmp_path, cache):
    folder = planar.write(tmp_path / "planar")
    robot = chasles.load(folder)
    assert hasattr(robot, "ik_planar")
    file = Path(folder / "manifest.json")
    content = json.loads(file.read_text())
    content["chain"] = content["chain"][::-1]
    file.write_text(json.dumps(content))
    assert not hasattr(chasles.load(folder), "ik_planar")
    assert hasattr(chasles.load(folder), "actuator_branches")
