"""Assembly modes of planar platforms: closed, complete, and each once."""

import time

import numpy as np
import pytest

import chasles
from tests.support.compiling import loaded
from tests.support.handwritten import planar

RODS = {"13/100": 0.13, "17/100": 0.17}


@pytest.fixture(scope="module", params=RODS)
def robot_and_rod(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp("planar")
    return loaded(planar.write(folder / "planar", request.param)), RODS[request.param]


def random_q(rng, n, rod):
    """Half of them at poses that exist, with every branch of the cranks."""
    anywhere = rng.uniform(-np.pi, np.pi, (n - n // 2, 3))
    poses = rng.uniform([-0.3, -0.3, -np.pi], [0.3, 0.3, np.pi], (200 * n, 3))
    held = planar.cranks(poses, rod, rng.choice([-1.0, 1.0], (200 * n, 3)))
    return np.concatenate([anywhere, held[np.isfinite(held).all(-1)][: n // 2]])


def errors(q, modes, rod):
    """Errors of the rods' lengths in the valid modes, from geometry alone."""
    gaps = planar.pins(modes.x) - planar.ends(q)[..., None, :, :]
    return (np.hypot(gaps[..., 0], gaps[..., 1]) - rod)[modes.valid]


def test_every_mode_closes_and_the_first_is_among_them(robot_and_rod):
    robot, rod = robot_and_rod
    q = random_q(np.random.default_rng(0), 20_000, rod)
    modes = robot.fk_planar_all(q)
    assert modes.x.shape == (20_000, 6, 3)
    assert np.abs(errors(q, modes, rod)).max() < 1e-12
    counts = np.bincount(modes.valid.sum(-1), minlength=7)
    # Real roots come in pairs.
    assert counts[1::2].sum() == 0
    assert modes.valid[10_000:].any(-1).all()
    assert (counts[[2, 4, 6]] > 20).all()
    x, valid = modes
    assert np.isnan(x[~valid]).all()
    assert np.isfinite(x[valid]).all()
    assert (np.abs(x[valid][:, 2]) <= np.pi).all()
    both = valid[:, 1:]
    assert (x[:, 1:, 2][both] >= x[:, :-1, 2][both]).all()
    assert (valid[:, :-1] >= both).all()


def test_the_pose_that_made_q_is_found(robot_and_rod):
    robot, rod = robot_and_rod
    rng = np.random.default_rng(1)
    pose = rng.uniform([-0.3, -0.3, -np.pi], [0.3, 0.3, np.pi], (100_000, 3))
    q = planar.cranks(pose, rod, rng.choice([-1.0, 1.0], pose.shape))
    held = np.isfinite(q).all(-1)
    assert held.sum() > 1000
    distance = np.abs(robot.fk_planar_all(q[held]).x - pose[held, None])
    distance[..., 2] = np.minimum(distance[..., 2], 2 * np.pi - distance[..., 2])
    assert np.nanmin(distance.max(-1), axis=-1).max() < 1e-7


# ------------------------------------------------------------ completeness


def residuals(q, phi, rod):
    """Residual of the third rod at both intersections of the first two, and their height^2.

    Geometry alone: the platform's origin is on three circles.
    """
    pose = np.stack([0 * phi, 0 * phi, phi], -1)
    centre = planar.ends(q)[:, None] - planar.pins(pose)
    along = centre[..., 1, :] - centre[..., 0, :]
    square = (along**2).sum(-1)
    height = rod**2 / square - 0.25
    with np.errstate(invalid="ignore"):
        across = np.sqrt(height)[..., None] * np.stack([-along[..., 1], along[..., 0]], -1)
    middle = (centre[..., 0, :] + centre[..., 1, :]) / 2
    third = [((middle + side * across - centre[..., 2, :]) ** 2).sum(-1) for side in (1, -1)]
    return np.stack(third) - rod**2, height


def scan(q, lower, upper, rod, levels):
    """Number of zeros between angles, from sign changes; doubtful cells are scanned finer."""
    points, *finer = levels
    found = np.zeros(len(q), int)
    if not len(q):
        return found
    phi = lower[:, None] + (upper - lower)[:, None] * np.linspace(0, 1, points)
    f, height = residuals(q, phi, rod)
    there = np.isfinite(f[0])
    changes = ((f[..., 1:] > 0) != (f[..., :-1] > 0)) & there[:, 1:] & there[:, :-1]
    # Where the first two circles cease to meet, both branches become one: different signs before
    # are a zero on the way.
    inner = np.where(there[:, 1:], (f[0] > 0)[:, 1:], (f[0] > 0)[:, :-1])
    outer = np.where(there[:, 1:], (f[1] > 0)[:, 1:], (f[1] > 0)[:, :-1])
    ends = there[:, 1:] != there[:, :-1]
    zeros = changes.sum(0) + (ends & (inner != outer))
    if finer:
        size = np.abs(f)
        low = (size[..., 1:-1] <= size[..., :-2]) & (size[..., 1:-1] <= size[..., 2:])
        flat = np.abs(height)
        low = low.any(0) | ((flat[:, 1:-1] <= flat[:, :-2]) & (flat[:, 1:-1] <= flat[:, 2:]))
        doubtful = ends.copy()
        doubtful[:, :-1] |= low
        doubtful[:, 1:] |= low
        row, cell = np.nonzero(doubtful)
        zeros[doubtful] = 0
        deeper = scan(q[row], phi[row, cell], phi[row, cell + 1], rod, finer)
        np.add.at(found, row, deeper)
    return found + zeros.sum(-1)


def test_no_mode_is_missed(robot_and_rod, capsys):
    robot, rod = robot_and_rod
    q = random_q(np.random.default_rng(2), 2000, rod)
    counts = robot.fk_planar_all(q).valid.sum(-1)
    whole = np.full(50, np.pi)
    scanned = np.concatenate(
        [scan(part, -whole, whole, rod, [1025, 33, 65]) for part in np.split(q, 40)]
    )
    with capsys.disabled():
        print(f"\nrods of {rod} m, 2000 inputs by number of modes 0 to 6:")
        print("  found   ", *np.bincount(counts, minlength=7))
        print("  scanned ", *np.bincount(scanned, minlength=7))
    np.testing.assert_array_equal(counts, scanned)


# ------------------------------------------------------------------- forms


def test_leading_dimensions_and_single_poses(robot_and_rod):
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


def test_symmetric_cranks(robot_and_rod):
    # The leading coefficient of the polynomial may vanish here, and modes are symmetric.
    robot, rod = robot_and_rod
    angles = np.radians(np.arange(0, 360, 15.0))
    q = angles[:, None] + planar.ANGLES
    modes = robot.fk_planar_all(q)
    assert np.abs(errors(q, modes, rod)).max() < 1e-12
    expected = scan(q, np.full(24, -3.0), np.full(24, 3.2832), rod, [1025, 33, 65])
    assert (modes.valid.sum(-1) >= expected).all()


def test_every_mode_within_microseconds(robot_and_rod):
    robot, rod = robot_and_rod
    q = random_q(np.random.default_rng(4), 5_000, rod)
    start = time.perf_counter()
    robot.modes(q)
    # 9 us on an idle core.
    assert time.perf_counter() - start < 5_000 * 60e-6
