"""Determinants, distances to singularities, and singularity curves of a planar platform."""

import numpy as np
import pytest

import chasles
from chasles.velocity.contours import zero_curves
from tests.support.compiling import loaded
from tests.support.handwritten import planar

ROD = 0.13
LONG, SHORT = planar.CRANK + ROD, planar.CRANK - ROD


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    folder = tmp_path_factory.mktemp("planar")
    return loaded(planar.write(folder / "planar", "13/100"))


def determinant(pose, length=1.0):
    """Returns the determinant of the rod lines, cranks to the left, or NaN out of reach."""
    pose = np.asarray(pose)
    q = planar.cranks(pose, ROD, 1.0)
    r = planar.pins(pose) - pose[..., None, :2]
    n = (planar.pins(pose) - planar.ends(q)) / ROD
    rows = np.concatenate([n, (r[..., :1] * n[..., 1:] - r[..., 1:] * n[..., :1]) / length], -1)
    sound = np.isfinite(rows).all((-2, -1))
    found = np.linalg.det(np.where(sound[..., None, None], rows, 0))
    return np.where(sound, found, np.nan)


def stretch(pose):
    """Returns the distance (..., 3) of each leg's end from the nearest limit of its reach."""
    reach = reaches(pose)
    return np.minimum(abs(reach - LONG), abs(reach - SHORT))


def reaches(pose):
    """Returns the distances (..., 3) of the pins from the base joints."""
    d = planar.pins(np.asarray(pose)) - planar.BASE * planar.DIRECTIONS
    return np.hypot(d[..., 0], d[..., 1])


def test_determinants_match_geometric_formula(robot):
    rng = np.random.default_rng(0)
    pose = rng.uniform([-0.08, -0.08, -0.3], [0.08, 0.08, 0.3], (200, 3))
    q = planar.cranks(pose, ROD, 1.0)
    pose, q = pose[np.isfinite(q).all(-1)], q[np.isfinite(q).all(-1)]
    assert len(q) > 50
    found = robot.determinants(pose, q, characteristic_length=0.2)
    np.testing.assert_allclose(found.J_x, determinant(pose, 0.2), atol=1e-12)
    _, J_q = robot.functions["velocity_relation"](pose, q)
    np.testing.assert_allclose(found.J_q, np.prod(np.diagonal(J_q, 0, 1, 2) / 0.2, -1), atol=1e-12)
    assert np.isnan(robot.determinants(pose[0], [np.nan, 0, 0]).J_x)
    with pytest.raises(chasles.InputValueError, match="length"):
        robot.determinants(pose[0], q[0], characteristic_length=-1.0)


def test_distance_to_singularity_matches_fine_scan(robot):
    rng = np.random.default_rng(1)
    start = rng.uniform([-0.03, -0.03, -0.2], [0.03, 0.03, 0.2], (50, 3))
    way = rng.uniform([-0.3, -0.3, -2], [0.3, 0.3, 2], (50, 3))
    way[::3] *= 0.3
    found = robot.distance_to_singularity(start, way, planar.cranks(start, ROD, 1.0))
    fine = np.linspace(0, 1, 20_001)
    kinds = np.zeros(3, int)
    for k in range(50):
        line = start[k] + fine[:, None] * way[k]
        reach = reaches(line)
        inside = ((reach < LONG) & (reach > SHORT)).all(-1)
        assert inside[0]
        out = fine[np.argmin(inside)] if not inside.all() else np.inf
        assert found.type_1[k] == pytest.approx(out, abs=6e-5)
        held = fine < min(out, 2)
        sign = determinant(line[held]) > 0
        changes = np.flatnonzero(sign[1:] != sign[:-1])
        first = fine[changes[0]] if len(changes) else np.inf
        assert found.type_2[k] == pytest.approx(first, abs=6e-5)
        kinds += [out < 2, first < 2, out > 2 and first > 2]
        for s, is_singular in (
            (
                found.type_1[k],
                stretch,
            ),
            (found.type_2[k], lambda x: abs(determinant(x))),
        ):
            if s < 2:
                assert np.min(is_singular(start[k] + s * way[k])) < 1e-9
    assert (kinds > 5).all()


def test_distance_to_singularity_is_nan_from_unreachable_start(robot):
    found = robot.distance_to_singularity([5.0, 0.0, 0.0], [1.0, 0.0, 0.0])
    assert np.isnan(found.type_1)
    assert np.isnan(found.type_2)
    assert robot.distance_to_singularity(np.zeros((0, 3)), np.zeros(3)).type_1.shape == (0,)
    many = robot.distance_to_singularity(np.zeros((2, 1, 3)), np.zeros((4, 3)))
    assert many.type_2.shape == (2, 4)
    with pytest.raises(chasles.ShapeError, match="theta must have shape"):
        robot.distance_to_singularity([0.0, 0.0], [1.0, 0.0])


@pytest.mark.parametrize("phi", [0.0, 0.4, 0.7])
def test_singularity_curves_are_singular_and_complete(robot, phi):
    side = (-0.35, 0.35)
    slot = robot.ik_planar([0.0, 0.0, 0.0]).q
    left = np.abs(slot - planar.cranks(np.zeros(3), ROD, 1.0)).max(-1).argmin()
    found = robot.singularity_curves(phi, side, side, slot=int(left), resolution=141)
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
    # Every sign change of the determinant on a finely sampled line is close to a singularity curve.
    checked = 0
    for y in np.linspace(-0.34, 0.34, 41):
        x = np.linspace(-0.34, 0.34, 2001)
        row = np.stack([x, np.full_like(x, y)], -1)
        values = determinant(posed(row))
        known = np.isfinite(values[1:]) & np.isfinite(values[:-1])
        for k in np.flatnonzero(known & ((values[1:] > 0) != (values[:-1] > 0))):
            distance = min(np.hypot(*(curve - row[k]).T).min() for curve in found.type_2)
            # A curve ends where a leg reaches its limit. A grid cell there may have no complete
            # edge.
            near = np.minimum(
                abs(reaches(posed(row[k])) - LONG), abs(reaches(posed(row[k])) - SHORT)
            )
            assert distance < 2 * cell or near.min() < 2 * cell
            checked += 1
    assert checked > 3


def test_non_ascending_bounds_are_rejected(robot):
    with pytest.raises(chasles.InputValueError, match="x and y must ascend"):
        robot.singularity_curves(0.0, (0, 1), (1, 1))


# --- curves of zeros ---


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


def test_singularity_curves_cover_reach_by_default(robot):
    default = robot.singularity_curves(0.4, resolution=141)
    wide = robot.singularity_curves(0.4, (-0.5, 0.5), (-0.5, 0.5), resolution=401)
    reached = [np.concatenate(found.type_2) for found in (default, wide)]
    for one, other in (reached, reversed(reached)):
        gaps = np.linalg.norm(one[:, None] - other, axis=-1).min(1)
        assert gaps.max() < 0.01
    assert robot.singularity_curves(0.4, x=(5.0, 6.0), y=(5.0, 6.0)) == ((), ())
