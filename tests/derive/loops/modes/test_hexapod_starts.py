"""Start poses with complex numbers for platforms on six rods."""

import numpy as np
import pytest

from chasles.derive.loops.modes.generic_platform import POSES, RODS
from chasles.derive.loops.modes.hexapod_starts import RodFamily, condition, followed, starts
from chasles.derive.loops.modes.soma import SixRods, quadrics, residuals


def rotation(e):
    w, x, y, z = e
    return np.array(
        [
            [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
        ]
    )


def product(x, y):
    vector = x[0] * y[1:] + y[0] * x[1:] + np.cross(x[1:], y[1:])
    return np.array([x[0] * y[0] - x[1:] @ y[1:], *vector])


def points(kind, generator):
    a, b = generator.normal(size=(2, 6, 3))
    if kind == "flat":
        a[:, 2] = b[:, 2] = 0
    if kind in ("6-3", "3-3"):
        b = b[[0, 0, 1, 1, 2, 2]]
    if kind == "3-3":
        a = a[[0, 1, 1, 2, 2, 0]]
    return a, b


def family(a, b, generator):
    return RodFamily(np.tile(a, (12, 1, 1)), b, generator.uniform(1, 2, (12, 6)))


def test_six_rod_equations_vanish_only_at_poses():
    generator = np.random.default_rng(0)
    for _ in range(50):
        a, b = generator.normal(size=(2, 6, 3))
        e, p = generator.normal(size=4), generator.normal(size=3)
        e /= np.linalg.norm(e)
        lengths = np.linalg.norm(p + b @ rotation(e).T - a, axis=1)
        rods = SixRods(a, b, (a**2).sum(1) + (b**2).sum(1) - lengths**2)
        x = np.concatenate([e, product(np.array([0, *p]), e)])
        assert np.abs(residuals(rods, x[None])).max() < 1e-13
        assert np.abs(np.einsum("kij,i,j->k", quadrics(rods), x, x)).max() < 1e-13
        other = x + 0.1 * generator.normal(size=8)
        forms = np.einsum("kij,i,j->k", quadrics(rods), other, other)
        np.testing.assert_allclose(forms, residuals(rods, other[None])[0], atol=1e-12)
        assert np.abs(forms).max() > 1e-3


def test_the_table_has_forty_different_poses():
    assert POSES.shape == (40, 8)
    assert np.abs(residuals(RODS, POSES)).max() < 1e-13
    along = np.abs(POSES.conj() @ POSES.T)
    assert (along - np.eye(40)).max() < 1 - 1e-4
    assert condition(RODS, POSES).max() < 1e5


COUNTS = {"6-6": 40, "flat": 40, "6-3": 16, "3-3": 16}
"""Number of complex poses of generic platforms of each kind. The sources are Raghavan 1993 (6-6)
and Nanua, Waldron and Murthy 1990 (3-3)."""


@pytest.mark.parametrize("kind", COUNTS)
def test_complex_pose_count_matches_known_number(kind):
    generator = np.random.default_rng(1)
    a, b = points(kind, generator)
    own, x = starts(family(a, b, generator))
    assert len(x) == COUNTS[kind]
    assert np.abs(residuals(own, x)).max() < 1e-13
    np.testing.assert_allclose(np.linalg.norm(x, axis=1), 1, atol=1e-15)
    assert (np.abs(x.conj() @ x.T) - np.eye(len(x))).max() < 1 - 1e-6


def test_monodromy_paths_permute_the_found_poses():
    """A closed path of the platform parameters permutes the complex poses of the platform."""
    generator = np.random.default_rng(2)
    a, b = points("3-3", generator)
    found = family(a, b, generator)
    own, x = starts(found)
    y = x
    for start, end in ((own, found.member(7)), (found.member(7), found.member(8))):
        y, arrived = followed(start, end, y)
        assert arrived.all()
    y, arrived = followed(found.member(8), own, y)
    assert arrived.all()
    same = np.abs(y.conj() @ x.T) > 1 - 1e-9
    np.testing.assert_array_equal(same.sum(0), 1)
    np.testing.assert_array_equal(same.sum(1), 1)


def test_start_poses_are_independent_of_rounding(monkeypatch):
    from chasles.derive.loops.modes import hexapod_starts

    generator = np.random.default_rng(3)
    a, b = points("3-3", generator)
    found = family(a, b, generator)
    _, x = starts(found)

    def disturbed(start, end, poses):
        y, arrived = followed(start, end, poses)
        noise = 1e-9 * np.random.default_rng(4).normal(size=y.shape)
        return (y + noise)[::-1], arrived[::-1]

    monkeypatch.setattr(hexapod_starts, "followed", disturbed)
    _, y = starts(found)
    np.testing.assert_array_equal(x, y)


def test_architecturally_singular_platform_has_no_start_pose():
    """The base points and the platform points form the same hexagon, with corners on a circle.

    Such a platform can move at constant leg lengths (Husty 2000).
    """
    generator = np.random.default_rng(5)
    angles = generator.uniform(0, 6, 6)
    a = np.stack([np.cos(angles), np.sin(angles), 0 * angles], 1)
    _, x = starts(family(a, a.copy(), generator))
    assert len(x) == 0
