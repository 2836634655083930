"""Singularity curves of a planar platform."""

import numpy as np
import pytest

import chasles
from chasles.study import SingularityCurves, singularity_curves
from chasles.study.planar.zero_curves import zero_curves
from tests.support.compiling import loaded
from tests.support.handwritten import planar

ROD = 0.13
LONG, SHORT = planar.CRANK + ROD, planar.CRANK - ROD


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    folder = tmp_path_factory.mktemp("planar")
    return loaded(planar.write(folder / "planar", "13/100"))


def determinant(pose, length=1.0):
    """Return the determinant of the rod lines, or NaN if the platform is out of reach."""
    pose = np.asarray(pose)
    q = planar.cranks(pose, ROD, 1.0)
    r = planar.pins(pose) - pose[..., None, :2]
    n = (planar.pins(pose) - planar.ends(q)) / ROD
    rows = np.concatenate([n, (r[..., :1] * n[..., 1:] - r[..., 1:] * n[..., :1]) / length], -1)
    sound = np.isfinite(rows).all((-2, -1))
    found = np.linalg.det(np.where(sound[..., None, None], rows, 0))
    return np.where(sound, found, np.nan)


def stretch(pose):
    """Return the distance (..., 3) of each leg from its nearest limit."""
    reach = reaches(pose)
    return np.minimum(abs(reach - LONG), abs(reach - SHORT))


def reaches(pose):
    """Return the distances (..., 3) of the pins from the base joints."""
    d = planar.pins(np.asarray(pose)) - planar.BASE * planar.DIRECTIONS
    return np.hypot(d[..., 0], d[..., 1])


@pytest.mark.parametrize("phi", [0.0, 0.4, 0.7])
def test_singularity_curves_are_singular_and_complete(robot, phi):
    side = (-0.35, 0.35)
    slot = robot.ik_planar([0.0, 0.0, 0.0]).q
    left = np.abs(slot - planar.cranks(np.zeros(3), ROD, 1.0)).max(-1).argmin()
    found = singularity_curves(robot, phi, side, side, slot=int(left), resolution=141)
    cell = 0.7 / 140

    def posed(points):
        return np.concatenate([points, np.full((*points.shape[:-1], 1), phi)], -1)

    for curve in found.type_1:
        assert stretch(posed(curve)).min(-1).max() < 1e-9
    for curve in found.type_2:
        assert np.nanmax(np.abs(determinant(posed(curve)))) < 1e-9
    assert len(found.type_1) >= 3
    for curve in (*found.type_1, *found.type_2):
        assert np.hypot(*np.diff(curve, axis=0).T).max() < 1.5 * cell
    # Every sign change of the determinant is close to a singularity curve.
    checked = 0
    for y in np.linspace(-0.34, 0.34, 41):
        x = np.linspace(-0.34, 0.34, 2001)
        row = np.stack([x, np.full_like(x, y)], -1)
        values = determinant(posed(row))
        known = np.isfinite(values[1:]) & np.isfinite(values[:-1])
        for k in np.flatnonzero(known & ((values[1:] > 0) != (values[:-1] > 0))):
            distance = min(np.hypot(*(curve - row[k]).T).min() for curve in found.type_2)
            # A singularity curve ends where a leg reaches its limit.
            near = np.minimum(
                abs(reaches(posed(row[k])) - LONG), abs(reaches(posed(row[k])) - SHORT)
            )
            assert distance < 2 * cell or near.min() < 2 * cell
            checked += 1
    assert checked > 3


def test_non_ascending_bounds_are_rejected(robot):
    with pytest.raises(chasles.InputValueError, match="expected ascending bounds x and y"):
        singularity_curves(robot, 0.0, (0, 1), (1, 1))


def test_unknown_branch_and_single_grid_line_are_rejected(robot):
    with pytest.raises(chasles.InputValueError, match="slot: expected less than 8, got 8"):
        singularity_curves(robot, 0.0, slot=8)
    with pytest.raises(chasles.InputValueError, match="resolution = 1: expected an integer"):
        singularity_curves(robot, 0.0, resolution=1)


# --- zero curves of functions ---


def test_zero_curve_of_circle_is_single_closed_curve():
    x = np.linspace(-2, 2, 60)
    (curve,) = zero_curves(lambda p: (p**2).sum(-1) - 1, x, x)
    np.testing.assert_array_equal(curve[0], curve[-1])
    np.testing.assert_allclose(np.hypot(*curve.T), 1, atol=1e-12)
    turned = np.unwrap(np.arctan2(curve[:, 1], curve[:, 0]))
    assert abs(turned[-1] - turned[0]) == pytest.approx(2 * np.pi)


def test_zero_curves_omit_poles_and_keep_hyperbola_branches():
    x = np.linspace(-2, 2, 61)
    with np.errstate(divide="ignore"):
        assert zero_curves(lambda p: 1 / (p[..., 0] - 0.011), x, x) == ()
    curves = zero_curves(lambda p: p[..., 0] * p[..., 1] - 0.01, x, x)
    assert len(curves) == 2
    for curve in curves:
        np.testing.assert_allclose(curve[:, 0] * curve[:, 1], 0.01, atol=1e-12)


def test_zero_curves_skip_undefined_regions():
    x = np.linspace(-2, 2, 61)
    found = zero_curves(lambda p: np.where(p[..., 0] > 0.3, p[..., 1] - 0.01, np.nan), x, x)
    (curve,) = found
    assert curve[:, 0].min() > 0.3
    assert zero_curves(lambda p: 1 + p[..., 0] ** 2, x, x) == ()


def test_singularity_curves_cover_reach_by_default():
    robot = chasles.load("planar_3rrr")
    default = singularity_curves(robot, 0.4, resolution=101)
    wide = singularity_curves(robot, 0.4, (-0.5, 0.5), (-0.5, 0.5), resolution=201)
    reached = [np.concatenate(found.type_2) for found in (default, wide)]
    for one, other in (reached, reversed(reached)):
        gaps = np.linalg.norm(one[:, None] - other, axis=-1).min(1)
        assert gaps.max() < 0.01
    far = singularity_curves(robot, 0.4, x=(5.0, 6.0), y=(5.0, 6.0), resolution=31)
    assert (far.type_1, far.type_2) == ((), ())


def test_singularity_curves_are_saved_plotted_and_refused_for_arms(tmp_path):
    pytest.importorskip("matplotlib").use("Agg")
    found = singularity_curves(chasles.load("planar_3rrr"), 0.1, resolution=31)
    found.save(tmp_path / "curves.npz")
    again = SingularityCurves.load(tmp_path / "curves.npz")
    for one, other in zip(found.type_1 + found.type_2, again.type_1 + again.type_2, strict=True):
        np.testing.assert_array_equal(one, other)
    names = [text.get_text() for text in found.plot().get_legend().get_texts()]
    assert names == [
        "type 1: a leg is stretched or folded",
        "type 2: the platform gains a degree of freedom",
    ]
    with pytest.raises(chasles.MissingFunctionError, match="'ur5e' has no 'ik_planar'"):
        singularity_curves(chasles.load("ur5e"), 0.1)
