"""Determinants and distances to singularities of a planar platform."""

import numpy as np
import pytest

import chasles
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
    """Return the difference (..., 3) between each leg's extension and its nearest limit."""
    reach = reaches(pose)
    return np.minimum(abs(reach - LONG), abs(reach - SHORT))


def reaches(pose):
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
    with pytest.raises(chasles.ShapeError, match="expected theta of shape"):
        robot.distance_to_singularity([0.0, 0.0], [1.0, 0.0])
