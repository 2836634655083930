"""Workspace areas agree with published values and with samples."""

from itertools import combinations, pairwise

import numpy as np
import pytest

import chasles
from chasles.derive import read
from chasles.errors import InputValueError
from chasles.study.planar.annuli import Annulus, area, border
from chasles.study.planar.planar_platform import (
    constant_orientation_workspace,
    dexterous_workspace,
    orientation_grid,
)
from tests.support.compiling import compiled
from tests.support.derivations import ROBOTS


@pytest.mark.parametrize(
    ("name", "degrees", "square_millimeters"),
    [
        ("planar_3rrr", 0, 64785.990758),
        ("planar_3rrr", 30, 49662.293227),
        ("planar_3rrr_170", 30, 89107.925046),
    ],
)
def test_constant_orientation_area_matches_reference(name, degrees, square_millimeters):
    found = constant_orientation_workspace(chasles.load(name), np.radians(degrees))
    assert found.area * 1e6 == pytest.approx(square_millimeters, rel=1e-10)


def by_chords(centers, inner, outer):
    """Integrate the lengths of horizontal chords inside annuli.

    The chord length has square-root singularities at heights where circles begin, end or intersect.
    The heights are the sines of Gauss points, scaled to each interval. This substitution removes
    the square-root singularities.
    """
    heights = [c[1] + sign * r for c in centers for r in (inner, outer) for sign in (-1, 1)]
    for a, b in combinations([(c, r) for c in centers for r in (inner, outer)], 2):
        d = b[0] - a[0]
        apart = np.hypot(*d)
        if apart > 0 and abs(a[1] - b[1]) < apart < a[1] + b[1]:
            along = (apart**2 + a[1] ** 2 - b[1] ** 2) / (2 * apart)
            across = np.sqrt(a[1] ** 2 - along**2)
            heights += [a[0][1] + (along * d[1] + sign * across * d[0]) / apart for sign in (-1, 1)]
    places, weights = np.polynomial.legendre.leggauss(60)
    total = 0.0
    for low, high in pairwise(sorted(heights)):
        angles = places * np.pi / 2
        y = (low + high) / 2 + (high - low) / 2 * np.sin(angles)
        steps = weights * np.pi / 2 * (high - low) / 2 * np.cos(angles)
        total += sum(w * chord(centers, inner, outer, at) for w, at in zip(steps, y, strict=True))
    return total


def chord(centers, inner, outer, y):
    halves = [np.sqrt(np.maximum(r**2 - (y - centers[:, 1]) ** 2, 0)) for r in (inner, outer)]
    ends = np.sort(np.concatenate([centers[:, 0] + s * half for half in halves for s in (-1, 1)]))
    middles = (ends[1:] + ends[:-1]) / 2
    distance = np.hypot(middles[:, None] - centers[:, 0], y - centers[:, 1])
    return np.diff(ends)[((distance > inner) & (distance < outer)).all(1)].sum()


@pytest.mark.parametrize(("name", "coupler"), [("planar_3rrr", 130), ("planar_3rrr_170", 170)])
@pytest.mark.parametrize("degrees", [15, 60])
def test_constant_orientation_area_matches_chord_integration(name, coupler, degrees):
    corners = np.radians([210, 330, 90])
    base, turned = corners, corners + np.radians(degrees)
    centers = 290 * np.column_stack([np.cos(base), np.sin(base)])
    centers = centers - 130 * np.column_stack([np.cos(turned), np.sin(turned)])
    expected = by_chords(centers, 170 - coupler, 170 + coupler)
    found = constant_orientation_workspace(chasles.load(name), np.radians(degrees))
    assert found.area * 1e6 == pytest.approx(expected, rel=1e-9)


def test_annuli_intersection_area_matches_monte_carlo():
    rng = np.random.default_rng(1)
    checked = 0
    for _ in range(40):
        annuli = [
            Annulus(rng.uniform(-1, 1, 2), inner, inner + rng.uniform(0.3, 2))
            for inner in rng.choice([0, 0.2, 0.7], 3)
        ]
        points = rng.uniform(-4, 4, (50_000, 2))
        inside = np.all([own.contains(points) for own in annuli], axis=0)
        share, found = inside.mean() * 64, area(annuli)
        deviation = 64 * np.sqrt(inside.mean() * (1 - inside.mean()) / len(points)) + 1e-4
        assert abs(found - share) < 5 * deviation
        checked += found > 0
    assert checked > 20


def test_annuli_areas_match_known_values():
    disk, hole = Annulus(np.zeros(2), 0, 2.0), Annulus(np.array([0.5, 0]), 0.5, 9.0)
    assert area([disk]) == pytest.approx(4 * np.pi, rel=1e-14)
    assert area([disk, hole]) == pytest.approx(3.75 * np.pi, rel=1e-14)
    assert area([disk, Annulus(np.array([9.0, 0]), 0, 1.0)]) == 0
    lens = [Annulus(np.zeros(2), 0, 1.0), Annulus(np.array([1.0, 0]), 0, 1.0)]
    assert area(lens) == pytest.approx(2 * np.pi / 3 - np.sqrt(3) / 2, rel=1e-14)
    assert len(border(lens)) == 2


def test_region_contains_exactly_poses_with_valid_inverse():
    platform = chasles.load("planar_3rrr")
    rng = np.random.default_rng(2)
    checked = 0
    for phi in np.radians([15, 30, 45, 60]):
        found = constant_orientation_workspace(platform, phi)
        points = rng.uniform(-0.35, 0.35, (1000, 2))
        poses = np.column_stack([points, np.full(len(points), phi)])
        solutions = platform.ik_planar(poses)
        reached = (solutions.valid | solutions.other_mode).any(-1)
        distance = np.min(
            [
                np.abs(np.linalg.norm(points - own.center, axis=1) - r)
                for own in found.pieces[0]
                for r in (own.inner, own.outer)
            ],
            axis=0,
        )
        clear = distance > 1e-9
        assert np.array_equal(found.contains(points)[clear], reached[clear])
        checked += reached.sum()
    assert checked > 150


@pytest.fixture(scope="module")
def dexterous_platform(tmp_path_factory):
    """Return a planar robot whose small platform reaches every angle near the center of the
    base."""
    folder = tmp_path_factory.mktemp("small")
    text = f'extends = "{ROBOTS / "planar_3rrr.toml"}"\nname = "small"\n'
    file = folder / "small.toml"
    file.write_text(text + "parameters = { r_p = 30, S_A = 185, L = 185 }\n")
    return compiled(read(file), folder / "small", ["fk", "actuators", "actuator_margin"], ["c"])


def test_dexterous_region_contains_all_orientations(dexterous_platform):
    rng = np.random.default_rng(3)
    points = rng.uniform(-0.15, 0.15, (1000, 2))
    angles = np.linspace(0, 2 * np.pi, 91)
    regions = [constant_orientation_workspace(dexterous_platform, phi) for phi in angles]
    always = np.all([region.contains(points) for region in regions], axis=0)
    found = dexterous_workspace(dexterous_platform).contains(points)
    assert 100 < found.sum() < 900
    assert (always | ~found).all()
    assert (found != always).mean() < 0.01


@pytest.mark.parametrize(("crank", "coupler", "r_p"), [(300, 350, 60)])
def test_dexterous_region_excludes_holes_that_rotate_around_tool(crank, coupler, r_p, tmp_path):
    """A leg with two links of unequal length cannot reach a disc around its pivot.

    The disc may move around the tool while the platform rotates.
    """
    file = tmp_path / "holed.toml"
    text = f'extends = "{ROBOTS / "planar_3rrr.toml"}"\nname = "holed"\n'
    file.write_text(text + f"parameters = {{ S_A = {crank}, L = {coupler}, r_p = {r_p} }}\n")
    platform = compiled(read(file), tmp_path / "holed", ["actuators", "actuator_margin"], ["c"])
    hole, r = abs(crank - coupler) / 1000, r_p / 1000
    regions = [
        constant_orientation_workspace(platform, phi) for phi in np.linspace(0, 2 * np.pi, 121)
    ]
    assert regions[0].pieces[0][0].inner == pytest.approx(hole, abs=1e-6)
    pivots = np.array(
        [
            (here.center + there.center) / 2
            for here, there in zip(regions[0].pieces[0], regions[60].pieces[0], strict=True)
        ]
    )
    rng = np.random.default_rng(6)
    near = pivots[rng.integers(3, size=1000)] + rng.uniform(-0.12, 0.12, (1000, 2))
    points = np.vstack([rng.uniform(-0.3, 0.3, (400, 2)), near])
    always = np.all([region.contains(points) for region in regions], axis=0)
    inside = dexterous_workspace(platform).contains(points)
    assert (always | ~inside).all()
    assert (inside != always).mean() < 5e-3
    assert 150 < inside.sum() < 1350
    # Points that the disc sweeps are not dexterous.
    away = np.linalg.norm(points[:, None] - pivots, axis=-1).min(1)
    assert (inside & (away < r - hole)).any() or hole > r
    assert not inside[(away > abs(r - hole)) & (away < r + hole)].any()


def test_total_area_never_exceeds_inclusive_area():
    platform = chasles.load("planar_3rrr_170")
    one = orientation_grid(platform, np.radians([30]), resolution=400)
    assert one.total == one.inclusive == pytest.approx(0.089107925046, rel=5e-3)
    few = orientation_grid(platform, np.radians([0, 30, 60]), resolution=200)
    assert few.total < one.total < few.inclusive


def test_total_area_over_full_rotation_equals_dexterous_area(dexterous_platform):
    whole = orientation_grid(dexterous_platform, np.linspace(0, 2 * np.pi, 60), resolution=200)
    assert whole.total == pytest.approx(dexterous_workspace(dexterous_platform).area, rel=3e-2)
    assert whole.fraction.max() == 1
    assert dexterous_workspace(chasles.load("planar_3rrr_170")).area == 0


def test_robots_without_three_planar_legs_are_rejected():
    for name in ("ur5e", "five_bar", "stewart_gough"):
        with pytest.raises(InputValueError, match="expected a planar platform with three legs"):
            constant_orientation_workspace(chasles.load(name), 0)


def test_constant_orientation_plot_states_angle():
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    axes = constant_orientation_workspace(chasles.load("planar_3rrr"), 0.5).plot()
    assert axes.get_title().startswith("planar_3rrr at 28.65°: ")
    matplotlib.pyplot.close("all")
