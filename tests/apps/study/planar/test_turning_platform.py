"""Orientation ranges of planar platforms agree with samples."""

import math

import numpy as np
import pytest

import chasles
from chasles.errors import InputValueError
from chasles.study import (
    constant_orientation_workspace,
    dexterous_workspace,
    orientation_range_workspace,
    singularity_curves,
)
from chasles.study.planar.annuli import Annulus
from chasles.study.planar.planar_platform import PlanarRegion
from chasles.study.planar.turning_platform import _inclusive, _Leg, _total


def legs(rng, width):
    turns = rng.uniform(-0.3, 0.3) + np.arange(3) * 2 * np.pi / 3
    return [
        _Leg(
            0.3 * np.array([math.cos(a), math.sin(a)]) + rng.uniform(-0.05, 0.05, 2),
            rng.uniform(0.05, 0.2),
            rng.uniform(-3, 3),
            width,
            inner := rng.choice([0.0, 0.05, 0.15]),
            inner + rng.uniform(0.25, 0.4),
        )
        for a in turns
    ]


def at_angles(own, points, count):
    """Test whether the platform reaches each of m points at each of `count` platform angles."""
    angles = np.linspace(0, own[0].width, count)
    found = []
    for angle in angles:
        centers = [leg.centers(np.array([angle]))[0] for leg in own]
        annuli = [Annulus(c, leg.inner, leg.outer) for c, leg in zip(centers, own, strict=True)]
        found.append(PlanarRegion("", "", (tuple(annuli),)).contains(points))
    return np.column_stack(found)


def test_orientation_range_areas_match_dense_angle_samples():
    rng, solid, count = np.random.default_rng(1), 0, 4000
    for _ in range(8):
        own = legs(rng, rng.uniform(0.1, 6))
        points = rng.uniform(-0.5, 0.5, (count, 2))
        possible = at_angles(own, points, 200)
        total, inclusive = _total(own), _inclusive(own, 5e-3)
        inside = total.contains(points)
        assert not (inside & ~possible.all(1)).any()
        assert (possible.all(1) & ~inside).mean() < 0.005
        deviation = 5 / math.sqrt(count) * inside.std() + 5 / count
        assert abs(total.area - inside.mean()) <= deviation
        share = possible.any(1)
        deviation = 5 / math.sqrt(count) * share.std() + 0.003
        assert abs(inclusive.value - share.mean()) <= inclusive.error + deviation
        assert inclusive.error <= 5e-3 * inclusive.value
        solid += total.area > 0
        if solid == 2:
            break
    assert solid == 2


def test_inclusive_area_error_is_a_bound():
    rng = np.random.default_rng(2)
    for _ in range(2):
        own = legs(rng, rng.uniform(0.1, 2))
        rough, fine = _inclusive(own, 3e-2), _inclusive(own, 4e-3)
        assert abs(rough.value - fine.value) <= rough.error + fine.error


def test_total_area_shrinks_with_orientation_range():
    platform = chasles.load("planar_3rrr")
    one = constant_orientation_workspace(platform, 0.5).area
    narrow = orientation_range_workspace(platform, 0.5 - 1e-9, 0.5 + 1e-9, tolerance=1e-2)
    assert narrow.total.area == pytest.approx(one, rel=1e-6)
    assert abs(narrow.inclusive.value - one) <= narrow.inclusive.error + 1e-8
    areas = [
        orientation_range_workspace(platform, -w, w, tolerance=0.05).total.area
        for w in (0.05, 0.2, 0.4)
    ]
    assert areas == sorted(areas, reverse=True)


def test_full_rotation_total_area_equals_annuli_intersection():
    rng = np.random.default_rng(5)
    for _ in range(20):
        own = legs(rng, 2 * np.pi)
        parts = [
            (leg.outer - leg.radius, leg.radius + leg.inner if leg.inner else 0.0) for leg in own
        ]
        annuli = tuple(
            Annulus(leg.middle, inner, max(outer, inner))
            for leg, (outer, inner) in zip(own, parts, strict=True)
        )
        if any(0 < leg.inner < leg.radius for leg in own):
            continue
        assert _total(own).area == pytest.approx(PlanarRegion("", "", (annuli,)).area, abs=1e-12)
    assert (
        orientation_range_workspace(
            chasles.load("planar_3rrr_170"), 0, 7, tolerance=0.05
        ).total.area
        == 0
    )
    assert dexterous_workspace(chasles.load("planar_3rrr_170")).area == 0


def test_singular_curves_have_zero_type_2_measure():
    platform, checked = chasles.load("planar_3rrr"), 0
    for degrees in (0, 45):
        phi = np.radians(degrees)
        found = singularity_curves(platform, phi, resolution=61)
        region = constant_orientation_workspace(platform, phi)
        for curve in found.type_2:
            inner = curve[region.contains(curve)]
            theta = np.column_stack([inner, np.full(len(inner), phi)])
            q = platform.actuators(theta)
            closed = np.isfinite(q).all(1)
            type_2 = platform.singularity(theta[closed], q[closed]).type_2
            assert (type_2 < 1e-6).all()
            checked += len(type_2)
    assert checked > 40


def test_plot_legend_names_singular_curves():
    pytest.importorskip("matplotlib").use("Agg")
    platform = chasles.load("planar_3rrr")
    axes = constant_orientation_workspace(platform, 0.5).plot(
        singular=singularity_curves(platform, 0.5, resolution=31)
    )
    assert axes.get_legend().get_texts()[0].get_text() == "platform gains a degree of freedom"


def test_invalid_orientation_range_arguments_are_rejected():
    platform = chasles.load("planar_3rrr")
    with pytest.raises(
        InputValueError, match="orientation_range_workspace: expected phi_min < phi_max"
    ):
        orientation_range_workspace(platform, 1, 0)
    with pytest.raises(InputValueError, match="expected a planar platform with three legs"):
        orientation_range_workspace(chasles.load("ur5e"), 0, 1)
