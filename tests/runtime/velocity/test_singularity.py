"""Distances from singularities of planar platforms, at poses with known distances."""

import numpy as np
import pytest

import chasles
from tests.support.compiling import loaded
from tests.support.handwritten import planar

ROD = 0.13


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    folder = tmp_path_factory.mktemp("planar")
    return loaded(planar.write(folder / "planar", "13/100"))


def lines(pose, q):
    """Return the lines (n, r x n) of the rods, computed from their end points."""
    r = planar.pins(pose) - np.asarray(pose)[..., None, :2]
    n = (planar.pins(pose) - planar.ends(q)) / ROD
    return np.concatenate([n, (r[..., :1] * n[..., 1:] - r[..., 1:] * n[..., :1])], -1)


def test_singularity_measures_match_their_definitions(robot):
    rng = np.random.default_rng(0)
    pose = rng.uniform([-0.08, -0.08, -0.3], [0.08, 0.08, 0.3], (200, 3))
    q = planar.cranks(pose, ROD, 1.0)
    pose, q = pose[np.isfinite(q).all(-1)], q[np.isfinite(q).all(-1)]
    assert len(q) > 50
    found = robot.singularity(pose, q, characteristic_length=0.2)
    J_x = lines(pose, q)
    # The platform velocity x' and the crank rates q' satisfy J_x x' = J_q q'. Row k of the product
    # J_q q' contains only the rate of crank k.
    arms = planar.CRANK * np.stack([-np.sin(q), np.cos(q)], -1)
    J_q = (arms * J_x[..., :2]).sum(-1)
    np.testing.assert_allclose(found.type_1, np.abs(J_q).min(-1) / 0.2, atol=1e-12)
    smallest = np.linalg.svd(J_x / [1, 1, 0.2], compute_uv=False)[..., -1]
    np.testing.assert_allclose(found.type_2, smallest, atol=1e-12)
    np.testing.assert_array_equal(found.type_3, np.maximum(found.type_1, found.type_2))


def test_stretched_leg_is_type_1_singularity(robot):
    # The platform moves away from the first base joint until the first crank and rod align.
    away = -planar.DIRECTIONS[0]
    shift = planar.CRANK + ROD - (planar.BASE - planar.PLATFORM)
    pose = np.append(shift * away, 0.0)
    q = planar.cranks(pose, ROD, 1.0)
    q[0] = np.arctan2(away[1], away[0])
    assert np.abs(robot.functions["rods"](pose, q)).max() < 1e-15
    found = robot.singularity(pose, q)
    assert found.type_1 < 1e-15
    assert found.type_2 > 0.1
    assert found.type_3 == found.type_2


def test_concurrent_rods_are_type_2_singularity(robot):
    end = planar.PLATFORM + ROD
    c = (planar.BASE**2 + end**2 - planar.CRANK**2) / (2 * planar.BASE * end)
    pose = np.array([0.0, 0.0, np.arccos(c)])
    cranks = planar.pins(pose) * end / planar.PLATFORM - planar.BASE * planar.DIRECTIONS
    q = np.arctan2(cranks[:, 1], cranks[:, 0])
    assert np.abs(robot.functions["rods"](pose, q)).max() < 1e-15
    found = robot.singularity(pose, q)
    assert found.type_2 < 1e-14
    assert found.type_1 > 0.1
    assert found.type_3 == found.type_1


def test_singularity_uses_characteristic_length_by_default(robot):
    pose = np.array([0.02, 0.01, 0.1])
    q = planar.cranks(pose, ROD, 1.0)
    z, at = np.array(robot.reference.z), np.array(robot.reference.q)
    # The robot has no Jacobian function, so platform velocities are computed for unit crank rates.
    J_x = lines(z, at)
    arms = planar.CRANK * np.stack([-np.sin(at), np.cos(at)], -1)
    rates = np.linalg.solve(J_x, np.diag((arms * J_x[:, :2]).sum(-1)))
    length = np.sqrt(((rates[:2] ** 2).sum(0) / rates[2] ** 2).mean())
    assert robot.characteristic_length == pytest.approx(length, rel=1e-12)
    given = robot.singularity(pose, q, characteristic_length=length)
    np.testing.assert_allclose(robot.singularity(pose, q), given, rtol=1e-12)
    with pytest.raises(chasles.InputError, match=r"characteristic_length must be positive, got -1"):
        robot.singularity(pose, q, characteristic_length=-1)


def test_default_singularity_length_equals_rates_length():
    platform = chasles.load("stewart_gough")
    theta, q = np.array(platform.reference.z)[:6], np.array(platform.reference.q)
    names = [variable.name for variable in platform.configuration_variables][:6]
    assert names == [joint.name for joint in platform.chain_joints]
    given = platform.singularity(theta, q, characteristic_length=platform.characteristic_length)
    np.testing.assert_array_equal(platform.singularity(theta, q), given)


def test_non_finite_pose_gives_nan_singularity_measures(robot):
    found = robot.singularity([[0.0, 0.0, 0.0], [np.nan, 0.0, 0.0]], np.zeros(3))
    assert [np.isnan(values).tolist() for values in found] == [[False, True]] * 3
