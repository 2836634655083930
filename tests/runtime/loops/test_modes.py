"""Assembly modes of planar platforms: all loops close, and each mode occurs exactly once."""

import numpy as np
import pytest

import chasles
from tests.support.compiling import loaded
from tests.support.handwritten import planar
from tests.support.loops.planar_scan import errors, random_q, scan

RODS = {"13/100": 0.13, "17/100": 0.17}


@pytest.fixture(scope="module", params=RODS)
def robot_and_rod(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp("planar")
    return loaded(planar.write(folder / "planar", request.param)), RODS[request.param]


def test_assembly_modes_close_and_come_in_pairs(robot_and_rod):
    robot, rod = robot_and_rod
    q = random_q(np.random.default_rng(0), 2000, rod)
    modes = robot.fk_planar_all(q)
    assert modes.x.shape == (2000, 6, 3)
    assert np.abs(errors(q, modes, rod)).max() < 1e-12
    counts = np.bincount(modes.valid.sum(-1), minlength=7)
    assert counts[1::2].sum() == 0
    assert modes.valid[1000:].any(-1).all()
    assert (counts[[2, 4, 6]] > 5).all()
    x, valid = modes
    assert np.isnan(x[~valid]).all()
    assert np.isfinite(x[valid]).all()
    assert (np.abs(x[valid][:, 2]) <= np.pi).all()
    both = valid[:, 1:]
    assert (x[:, 1:, 2][both] >= x[:, :-1, 2][both]).all()
    assert (valid[:, :-1] >= both).all()


def test_modes_contain_generating_pose(robot_and_rod):
    robot, rod = robot_and_rod
    rng = np.random.default_rng(1)
    pose = rng.uniform([-0.3, -0.3, -np.pi], [0.3, 0.3, np.pi], (50_000, 3))
    q = planar.cranks(pose, rod, rng.choice([-1.0, 1.0], pose.shape))
    held = np.isfinite(q).all(-1)
    assert held.sum() > 500
    distance = np.abs(robot.fk_planar_all(q[held]).x - pose[held, None])
    distance[..., 2] = np.minimum(distance[..., 2], 2 * np.pi - distance[..., 2])
    assert np.nanmin(distance.max(-1), axis=-1).max() < 1e-7


# ------------------------------------------------------------ completeness


def test_mode_count_matches_exhaustive_scan(robot_and_rod, capsys):
    robot, rod = robot_and_rod
    q = random_q(np.random.default_rng(2), 200, rod)
    counts = robot.fk_planar_all(q).valid.sum(-1)
    whole = np.full(50, np.pi)
    scanned = np.concatenate(
        [scan(part, -whole, whole, rod, [1025, 33, 65]) for part in np.split(q, 4)]
    )
    with capsys.disabled():
        print(f"\nrods of {rod} m, 200 inputs by number of modes 0 to 6:")
        print("  found   ", *np.bincount(counts, minlength=7))
        print("  scanned ", *np.bincount(scanned, minlength=7))
    np.testing.assert_array_equal(counts, scanned)


# ------------------------------------------------------- arguments and results of a call


def test_modes_accept_any_leading_dimensions(robot_and_rod):
    robot, rod = robot_and_rod
    q = random_q(np.random.default_rng(3), 12, rod).reshape(3, 4, 3)
    modes = robot.fk_planar_all(q)
    assert (modes.x.shape, modes.valid.shape) == ((3, 4, 6, 3), (3, 4, 6))
    single = robot.fk_planar_all(q[2, 3].tolist())
    assert single.x.shape == (6, 3)
    np.testing.assert_allclose(single.x, modes.x[2, 3], atol=1e-9)
    assert robot.fk_planar_all(q[:0]).x.shape == (0, 4, 6, 3)
    assert not robot.fk_planar_all([np.nan, 0.0, 0.0]).valid.any()
    with pytest.raises(chasles.ShapeError, match="q must end in 3 values"):
        robot.fk_planar_all([0.0, 1.0])


def test_modes_are_complete_for_symmetric_cranks(robot_and_rod):
    # At multiples of 15 degrees, the leading coefficient of the polynomial may vanish, and modes
    # are symmetric.
    robot, rod = robot_and_rod
    angles = np.radians(np.arange(0, 360, 15.0))
    q = angles[:, None] + planar.ANGLES
    modes = robot.fk_planar_all(q)
    assert np.abs(errors(q, modes, rod)).max() < 1e-12
    expected = scan(q, np.full(24, -3.0), np.full(24, 3.2832), rod, [1025, 33, 65])
    assert (modes.valid.sum(-1) >= expected).all()
