"""If the closed form misses a pose, Newton's method starts from least-squares configurations."""

import json

import numpy as np
import pytest

import chasles
from chasles.contract import read_manifest
from tests.support.compiling import compiled, loaded
from tests.support.fixed import fixed_at
from tests.support.generators.drawn_arms import random_arm
from tests.support.oracles.screws import screws_of

ARM = 4220
FUNCTIONS = ["fk", "fk_jacobian_mixed", "ik"]
GIVEN = [0, 5]
SCREWS = screws_of(random_arm(ARM))
QUARTERS = np.arange(-1, 3) * (np.pi / 2)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("search") / "arm"
    compiled(random_arm(ARM), folder, FUNCTIONS, ["c"])
    return folder


@pytest.fixture(scope="module")
def arm(folder):
    return loaded(folder)


@pytest.fixture(scope="module")
def q():
    q = np.random.default_rng(0).choice(QUARTERS, (60, 8))
    q[:, 5] = -0.4
    return q


@pytest.fixture(scope="module")
def T(q):
    return SCREWS.fk(q)


def test_manifest_declares_search_and_fixed_joints(folder):
    (info,) = (info for info in read_manifest(folder).functions if info.role.is_inverse)
    assert info.role.searches
    assert list(info.role.fixed) == GIVEN


def test_bare_closed_form_misses_right_angle_poses(arm, q, T):
    _, residual, _ = arm.ik.ufunc(T, q[:, 0], q[:, 5])
    assert (residual.min(axis=1) > 1e-3).sum() > 20


def test_search_finds_every_missed_pose(arm, q, T):
    found = arm.ik(T, fixed=fixed_at(arm, q))
    assert found.valid.any(axis=1).all()
    apart = SCREWS.fk(found.q) - T[:, None]
    assert np.abs(apart).max(axis=(-1, -2))[found.valid].max() < 1e-9
    np.testing.assert_array_equal(found.q[..., GIVEN], np.repeat(q[:, None, GIVEN], 8, axis=1))


def test_search_works_for_single_poses(arm, q, T):
    _, residual, _ = arm.ik.ufunc(T, q[:, 0], q[:, 5])
    lost = np.flatnonzero(residual.min(axis=1) > 1e-3)
    assert len(lost) > 20
    for i in lost[:10]:
        solutions = arm.ik(T[i], fixed=fixed_at(arm, q[i])).valid_q()
        assert len(solutions)
        assert np.abs(SCREWS.fk(solutions) - T[i]).max() < 1e-9


def test_search_keeps_unreachable_poses_unchanged(arm):
    rng = np.random.default_rng(1)
    q = rng.uniform(-3, 3, (400, 8))
    q[:, 5] = rng.uniform(-0.4, 0.4, 400)
    T = SCREWS.fk(q)
    away = rng.normal(size=(400, 3))
    T[:, :3, 3] = rng.uniform(2.5, 5, (400, 1)) * away / np.linalg.norm(away, axis=1, keepdims=True)
    found = arm.ik(T, fixed=fixed_at(arm, q))
    q_bare, residual, _ = arm.ik.ufunc(T, q[:, 0], q[:, 5])
    assert not found.valid.any()
    np.testing.assert_array_equal(found.q, q_bare)
    np.testing.assert_array_equal(found.residual, residual)


def test_valid_flag_matches_pose_error(arm):
    """Only some of the poses are reachable. Each valid solution reaches its pose."""
    rng = np.random.default_rng(2)
    q = rng.uniform(-3, 3, (400, 8))
    q[:, 5] = rng.uniform(-0.4, 0.4, 400)
    T = SCREWS.fk(q)
    T[:, :3, 3] += rng.normal(scale=0.3, size=(400, 3))
    found = arm.ik(T, fixed=fixed_at(arm, q))
    apart = np.abs(SCREWS.fk(found.q) - T[:, None]).max(axis=(-1, -2))
    assert 50 < found.valid.any(axis=1).sum() < 350
    assert apart[found.valid].max() < 2e-9
    assert apart[~found.valid].min() > 5e-10


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"searches": "yes"}, "searches: .* expected true or false"),
        ({"free": [8]}, "free: .* expected indices below 8"),
        ({"components": ["yaw"]}, 'components.*: .* expected "position" or'),
        ({"components": ["position", "pitch"]}, "components: .* expected components of"),
        ({"components": ["pitch"]}, r"components: .* expected components of \(4, 4\) entries"),
    ],
    ids=[
        "searches not boolean",
        "index out of range",
        "unknown task part",
        "incompatible task parts",
        "task part of the size of a fixed coordinate",
    ],
)
def test_invalid_search_entry_in_manifest_is_rejected(folder, tmp_path, change, message):
    content = json.loads((folder / "manifest.json").read_text())
    next(f for f in content["functions"] if f["role"] == "inverse").update(change)
    (tmp_path / "manifest.json").write_text(json.dumps(content))
    with pytest.raises(chasles.ManifestError, match=message):
        read_manifest(tmp_path)
