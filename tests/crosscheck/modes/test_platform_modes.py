"""Assembly modes of six-rod platforms: published platforms and a sample of the campaign."""

from functools import cache

import numpy as np
import pytest

from tests.campaigns import platforms

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
# Rod end positions of the default machine in LinuxCNC's kinematics module genhexkins.
HEXKINS_BASE = [(-22.95, 13.25), (22.95, 13.25), (22.95, 13.25), (0, -26.5), (0, -26.5)]
HEXKINS_BASE = [*HEXKINS_BASE, (-22.95, 13.25)]
HEXKINS_PLATFORM = [(-1, 11.5), (1, 11.5), (10.459, -4.884), (9.459, -6.616), (-9.459, -6.616)]
HEXKINS_PLATFORM = [*HEXKINS_PLATFORM, (-10.459, -4.884)]


@cache
def general_rods():
    """Return rod ends and lengths of a platform that loses assembly modes at a singularity."""
    return platforms.random_rods("6-6", np.random.default_rng(5))


@cache
def general_platform():
    return platforms.numbered(*general_rods())


def flat(points):
    return np.array([[x, y, 0.0] for x, y in points])


def distances(a, b, R, p):
    return np.linalg.norm(p + b @ R.T - a, axis=1)


def errors(a, b, lengths, theta):
    e = platforms.quaternions(theta)
    return np.abs(
        [
            distances(a, b, R, x[:3]) - lengths
            for R, x in zip(platforms.rotations(e), theta, strict=True)
        ]
    )


def test_dietmaier_platform_has_40_real_modes():
    """All 40 assembly modes of this platform are real (Dietmaier 1998)."""
    a, b, lengths = map(np.array, (DIETMAIER_BASE, DIETMAIER_PLATFORM, DIETMAIER_LENGTHS))
    theta, unsure = platforms.modes(a, b, lengths)
    assert len(theta) == 40
    assert unsure == 0
    assert errors(a, b, lengths, theta).max() < 1e-14


def test_linuxcnc_hexapod_modes_match_newton():
    a, b = flat(HEXKINS_BASE), flat(HEXKINS_PLATFORM)
    generator = np.random.default_rng(1)
    e = np.array([1.0, *generator.uniform(-0.1, 0.1, 3)])
    R = platforms.rotations(e[None] / np.linalg.norm(e))[0]
    lengths = distances(a, b, R, np.array([*generator.uniform(-3, 3, 2), 20]))
    theta, unsure = platforms.modes(a, b, lengths)
    assert unsure == 0
    # Platform and base are flat, so the mirror image of each assembly mode is also an assembly
    # mode.
    assert len(theta) % 2 == 0
    np.testing.assert_allclose(theta[:, 2], -theta[::-1, 2], atol=1e-9)
    assert errors(a, b, lengths, theta).max() < 1e-12 * 50
    found, positions = platforms.newton(a, b, lengths, 400, generator)
    assert len(found) == len(theta)
    apart = np.abs(positions[:, None] - theta[None, :, :3]).max(-1)
    assert apart.min(1).max() < 1e-6


@pytest.mark.parametrize("kind", ["6-6", "6-3"])
def test_modes_contain_every_newton_solution(kind):
    generator = np.random.default_rng(22)
    rods = platforms.random_rods(kind, generator)
    found = platforms.judged(*rods, 300, generator)
    assert (found.missed, found.wrong, found.unsure) == (0, 0, False)
    assert found.modes >= 4


def test_modes_are_invariant_to_base_offset_and_scale():
    a, b, lengths = general_rods()
    solution = platforms.solved(general_platform(), a, lengths)
    expected = solution.theta[np.isfinite(solution.margin)]
    # All rod ends are shifted, and all lengths are multiplied by 1000.
    shift, middle, factor = np.array([300.0, -200, 50]), np.array([5.0, 2, -7]), 1e3
    theta, unsure = platforms.modes(factor * (a + shift), factor * (b + middle), factor * lengths)
    assert unsure == 0
    e = platforms.quaternions(theta)
    moved = theta[:, :3] / factor + platforms.rotations(e) @ middle - shift
    order, other = (np.lexsort(x.round(6).T) for x in (expected[:, 3:], theta[:, 3:]))
    np.testing.assert_allclose(moved[other], expected[order, :3], atol=1e-8)
    factor = 1e-4
    theta, unsure = platforms.modes(factor * a, factor * b, factor * lengths)
    assert unsure == 0
    np.testing.assert_allclose(theta[:, :3] / factor, expected[:, :3], atol=1e-9)
    np.testing.assert_allclose(theta[:, 3:], expected[:, 3:], atol=1e-9)


def test_impossible_leg_lengths_give_no_mode():
    a, _, lengths = general_rods()
    platform = general_platform()
    long = platforms.solved(platform, a, lengths * [100, 1, 1, 1, 1, 1])
    assert np.isnan(long.theta).all()
    assert long.unsure == 0
    for bad in (np.nan, np.inf):
        odd = np.array([bad, *lengths[1:]])
        numbers = platforms.solved(platform, a, odd)
        assert np.isnan(numbers.theta).all()
        assert np.isnan(numbers.margin).all()
        assert np.isnan(numbers.unsure)
    negative = platforms.solved(platform, a, -lengths)
    assert np.isnan(negative.theta).all()
    assert negative.unsure == 0


def test_mode_count_drops_by_two_at_singularity():
    """Two assembly modes of the platform merge at a singular pose."""
    a, _, lengths = general_rods()
    platform = general_platform()
    counts = []
    for stretch in np.linspace(1, 2, 30):
        stretched = lengths * [stretch, 1, 1, 1, 1, 1]
        found = platforms.solved(platform, a, stretched)
        assert found.unsure == 0
        counts.append(np.isfinite(found.margin).sum())
    assert set(np.diff(counts)) <= {-2, 0, 2}
    assert counts[-1] < counts[0]


@pytest.mark.parametrize("kind", ["3-3", "3-6"])
def test_elimination_agrees_with_continuation_for_double_joints(kind):
    generator = np.random.default_rng(6)
    a, b, lengths = platforms.random_rods("3-3" if kind == "3-3" else "6-3", generator)
    if kind == "3-6":
        a, b = b, a
    platform = platforms.numbered(a, b, lengths)
    assert platform.joined == (2 if kind == "3-6" else 1)
    others = platforms.Platform.from_buffer_copy(platform)
    others.joined = 0
    # Without start points for path tracking, the solver sets `unsure` if the elimination does not
    # determine the modes.
    platform.starts = type(platform.starts)()
    counts, left = set(), 0
    for _ in range(100):
        e, p = generator.normal(size=4), generator.normal(size=3)
        R = platforms.rotations(e[None] / np.linalg.norm(e))[0]
        lengths = distances(a, b, R, p)
        found = platforms.solved(platform, a, lengths)
        expected = platforms.solved(others, a, lengths)
        assert expected.unsure == 0
        if found.unsure:
            left += 1
            continue
        np.testing.assert_allclose(found.theta[:, :3], expected.theta[:, :3], atol=1e-7)
        counts.add(int(np.isfinite(found.margin).sum()))
        if kind == "3-3":
            # The base is flat, so the mirror image of each assembly mode is also an assembly mode.
            assert counts <= {0, 2, 4, 6, 8, 10, 12, 14, 16}
    assert len(counts) > 2
    assert left <= 2
