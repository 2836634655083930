"""Modes of platforms on six rods: published ones, and random ones beside Newton's iteration."""

import numpy as np
import pytest

from tests.campaigns import platforms as platform_modes

DIETMAIER_BASE = [
    [0, 0, 0],
    [1.107915, 0, 0],
    [0.549094, 0.756063, 0],
    [0.735077, -0.223935, 0.525991],
    [0.514188, -0.526063, -0.368418],
    [0.590473, 0.094733, -0.205018],
]
DIETMAIER_PLATFORM = [
    [0, 0, 0],
    [0.542805, 0, 0],
    [0.956919, -0.528915, 0],
    [0.665885, -0.353482, 1.402538],
    [0.478359, 1.158742, 0.107672],
    [-0.137087, -0.235121, 0.353913],
]
DIETMAIER_LENGTHS = [1, 0.645275, 1.086284, 1.503439, 1.281933, 0.771071]
# LinuxCNC, genhexkins: the default machine.
HEXKINS_BASE = [(-22.95, 13.25), (22.95, 13.25), (22.95, 13.25), (0, -26.5), (0, -26.5)]
HEXKINS_BASE = [*HEXKINS_BASE, (-22.95, 13.25)]
HEXKINS_PLATFORM = [(-1, 11.5), (1, 11.5), (10.459, -4.884), (9.459, -6.616), (-9.459, -6.616)]
HEXKINS_PLATFORM = [*HEXKINS_PLATFORM, (-10.459, -4.884)]


@pytest.fixture(scope="module")
def library():
    return platform_modes._library()


def flat(points):
    return np.array([[x, y, 0.0] for x, y in points])


def distances(a, b, R, p):
    return np.linalg.norm(p + b @ R.T - a, axis=1)


def errors(a, b, lengths, theta):
    e = platform_modes._quaternions(theta)
    return np.abs(
        [
            distances(a, b, R, x[:3]) - lengths
            for R, x in zip(platform_modes.rotations(e), theta, strict=True)
        ]
    )


def test_forty_real_poses(library):
    """Dietmaier 1998: all solutions of this platform are real."""
    a, b, lengths = map(np.array, (DIETMAIER_BASE, DIETMAIER_PLATFORM, DIETMAIER_LENGTHS))
    theta, unsure, _ = platform_modes.modes(library, a, b, lengths)
    assert len(theta) == 40
    assert unsure == 0
    assert errors(a, b, lengths, theta).max() < 1e-14


def test_hexapod_of_linuxcnc(library):
    a, b = flat(HEXKINS_BASE), flat(HEXKINS_PLATFORM)
    generator = np.random.default_rng(1)
    for _ in range(2):
        e = np.array([1.0, *generator.uniform(-0.1, 0.1, 3)])
        R = platform_modes.rotations(e[None] / np.linalg.norm(e))[0]
        lengths = distances(a, b, R, np.array([*generator.uniform(-3, 3, 2), 20]))
        theta, unsure, _ = platform_modes.modes(library, a, b, lengths)
        assert unsure == 0
        # A flat platform above a flat base: each mode has its mirror image.
        assert len(theta) % 2 == 0
        np.testing.assert_allclose(theta[:, 2], -theta[::-1, 2], atol=1e-9)
        assert errors(a, b, lengths, theta).max() < 1e-12 * 50
        found, positions = platform_modes.newton(a, b, lengths, 1_000, generator)
        assert len(found) == len(theta)
        apart = np.abs(positions[:, None] - theta[None, :, :3]).max(-1)
        assert apart.min(1).max() < 1e-6


@pytest.mark.parametrize("kind", platform_modes.KINDS)
def test_no_mode_of_newtons_iteration_is_missed(library, kind):
    generator = np.random.default_rng(2)
    modes = 0
    for _ in range(2):
        rods = platform_modes.random_rods(kind, generator)
        found = platform_modes.judged(library, *rods, 1_000, generator)
        assert (found.missed, found.wrong, found.unsure) == (0, 0, False)
        modes += found.modes
    assert modes >= 4


def test_the_base_may_be_anywhere_and_of_any_size(library):
    generator = np.random.default_rng(3)
    a, b, lengths = platform_modes.random_rods("6-6", generator)
    expected, *_ = platform_modes.modes(library, a, b, lengths)
    shift, middle = np.array([300.0, -200, 50]), np.array([5.0, 2, -7])
    theta, unsure, _ = platform_modes.modes(library, a + shift, b + middle, lengths)
    assert unsure == 0
    e = platform_modes._quaternions(theta)
    moved = theta[:, :3] + platform_modes.rotations(e) @ middle - shift
    order, other = (np.lexsort(x.round(6).T) for x in (expected[:, 3:], theta[:, 3:]))
    np.testing.assert_allclose(moved[other], expected[order, :3], atol=1e-8)
    for factor in (1e-4, 1e3):
        theta, unsure, _ = platform_modes.modes(library, factor * a, factor * b, factor * lengths)
        assert unsure == 0
        np.testing.assert_allclose(theta[:, :3] / factor, expected[:, :3], atol=1e-9)
        np.testing.assert_allclose(theta[:, 3:], expected[:, 3:], atol=1e-9)


def test_where_there_is_no_pose(library):
    generator = np.random.default_rng(4)
    a, b, lengths = platform_modes.random_rods("6-6", generator)
    platform = platform_modes.numbered(a, b, lengths)
    long = platform_modes.solved(library, platform, a, lengths * [100, 1, 1, 1, 1, 1])
    assert np.isnan(long.theta).all()
    assert long.unsure == 0
    for bad in (np.nan, np.inf):
        odd = np.array([bad, *lengths[1:]])
        numbers = platform_modes.solved(library, platform, a, odd)
        assert np.isnan(numbers.theta).all()
        assert np.isnan(numbers.margin).all()
        assert np.isnan(numbers.unsure)
    negative = platform_modes.solved(library, platform, a, -lengths)
    assert np.isnan(negative.theta).all()
    assert negative.unsure == 0


def test_two_modes_that_meet(library):
    """Towards a singular pose two modes come together, and beyond it there are two fewer."""
    generator = np.random.default_rng(5)
    a, b, lengths = platform_modes.random_rods("6-6", generator)
    platform = platform_modes.numbered(a, b, lengths)
    counts = []
    for stretch in np.linspace(1, 2, 60):
        stretched = lengths * [stretch, 1, 1, 1, 1, 1]
        found = platform_modes.solved(library, platform, a, stretched)
        assert found.unsure == 0
        counts.append(np.isfinite(found.margin).sum())
    assert set(np.diff(counts)) <= {-2, 0, 2}
    assert counts[-1] < counts[0]


@pytest.mark.parametrize("kind", ["6-3", "3-3", "3-6"])
def test_double_joints_by_elimination_and_by_paths(library, kind):
    generator = np.random.default_rng(6)
    a, b, lengths = platform_modes.random_rods("3-3" if kind == "3-3" else "6-3", generator)
    if kind == "3-6":
        a, b = b, a
    platform = platform_modes.numbered(a, b, lengths)
    assert platform.joined == (2 if kind == "3-6" else 1)
    others = platform_modes.Platform.from_buffer_copy(platform)
    others.joined = 0
    # Paths from nowhere: what the elimination leaves to them is not sure.
    platform.starts = type(platform.starts)()
    counts, left = set(), 0
    for _ in range(100):
        e, p = generator.normal(size=4), generator.normal(size=3)
        R = platform_modes.rotations(e[None] / np.linalg.norm(e))[0]
        lengths = distances(a, b, R, p)
        found = platform_modes.solved(library, platform, a, lengths)
        expected = platform_modes.solved(library, others, a, lengths)
        assert expected.unsure == 0
        if found.unsure:
            left += 1
            continue
        np.testing.assert_allclose(found.theta[:, :3], expected.theta[:, :3], atol=1e-7)
        counts.add(int(np.isfinite(found.margin).sum()))
        if kind == "3-3":
            # The base is a plane: each mode has its mirror image.
            assert counts <= {0, 2, 4, 6, 8, 10, 12, 14, 16}
    assert len(counts) > 2
    assert left <= 2
