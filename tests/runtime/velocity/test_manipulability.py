"""Manipulability agrees with textbook formulas, NumPy and finite differences."""

import numpy as np
import pytest

import chasles
from chasles.derive import read
from tests.support.compiling import compiled
from tests.support.derivations import description
from tests.support.rate_inputs import WITH_RATES, inside, pure

ROWS = {"all": slice(0, 6), "linear": slice(0, 3), "angular": slice(3, 6)}


@pytest.fixture(scope="module")
def ur5e():
    return chasles.load("ur5e")


def test_planar_arm_manipulability_matches_textbook_formula():
    """The manipulability w = a1 a2 |sin q2| is largest at an elbow angle of 90 degrees.

    Source: Yoshikawa 1985, section 4. In this formula, a1 and a2 are the link lengths, and q2 is
    the elbow angle.
    """
    scara = chasles.load("scara")
    q = inside(scara, 200)
    a1, a2 = (np.linalg.norm(x) for x in planar_links(scara))
    found = scara.manipulability(q, components="linear", characteristic_length=1.0)
    # The prismatic joint is the third degree of freedom of the tip, with singular value 1.
    expected = a1 * a2 * np.abs(np.sin(q[:, 1]))
    np.testing.assert_allclose(found.measure, expected, rtol=0, atol=1e-14)
    gradient = scara.manipulability_gradient(q, components="linear", characteristic_length=1.0)
    slope = a1 * a2 * np.cos(q[:, 1]) * np.sign(np.sin(q[:, 1]))
    np.testing.assert_allclose(gradient[:, 1], slope, rtol=0, atol=1e-13)
    assert np.abs(gradient[:, [0, 2, 3]]).max() < 1e-14


def planar_links(scara):
    """Compute both link vectors from the tip positions at elbow angles of 0 and 180 degrees."""
    p = [scara.fk([0, angle, 0.05, 0])[:2, 3] for angle in (0, np.pi)]
    return (p[0] + p[1]) / 2, (p[0] - p[1]) / 2


@pytest.mark.parametrize("components", ROWS)
@pytest.mark.parametrize("name", ["ur5e", "panda", "photo_robot", "stanford", "lynxmotion"])
def test_manipulability_measures_match_their_definitions(name, components):
    robot = chasles.load(name)
    q = inside(robot, 200)
    part = ROWS[components]
    J = pure(robot, q)[0][:, part]
    found = robot.manipulability(q, components=components)
    sigma = np.linalg.svd(J, compute_uv=False)
    np.testing.assert_allclose(found.singular_values, sigma, rtol=0, atol=1e-13)
    squared = J @ J.mT if J.shape[1] <= robot.n else J.mT @ J
    root = np.sqrt(np.maximum(np.linalg.det(squared), 0))
    np.testing.assert_allclose(found.measure, root, rtol=0, atol=1e-9)
    np.testing.assert_allclose(found.min_singular_value, sigma[:, -1], rtol=0, atol=1e-13)
    assert (found.condition >= 1).all()
    given = robot.manipulability(q, components=components, characteristic_length=0.7)
    J = pure(robot, q, 0.7)[0][:, part]
    np.testing.assert_allclose(
        given.singular_values, np.linalg.svd(J, compute_uv=False), rtol=0, atol=1e-13
    )


@pytest.mark.parametrize("components", ROWS)
@pytest.mark.parametrize("name", WITH_RATES)
def test_manipulability_gradient_matches_differences(name, components):
    robot = chasles.load(name)
    q = inside(robot, 200)
    found = robot.manipulability_gradient(q, components=components)
    measure = robot.manipulability(q, components=components)
    # The expected derivatives are high-order differences at configurations away from kinks of the
    # manipulability measure.
    away = measure.min_singular_value > 0.05
    h = 1e-3 * np.where([c.kind == "revolute" for c in robot.coordinates], 1.0, 0.1)
    for k in range(robot.n):
        step = h[k] * np.eye(robot.n)[k]
        at = [
            robot.manipulability(q + m * step, components=components).measure
            for m in (-2, -1, 1, 2)
        ]
        expected = (at[0] - 8 * at[1] + 8 * at[2] - at[3]) / (12 * h[k])
        scale = 1 + np.abs(expected) + np.abs(found[:, k])
        assert (np.abs(found[:, k] - expected) / scale)[away].max(initial=0) < 1e-7
    assert np.isfinite(found).all()


def test_velocity_and_force_ellipsoids_match_jacobian(ur5e):
    q = inside(ur5e, 50)
    J = ur5e.jacobian_mixed(q)
    rng = np.random.default_rng(1)
    qd = rng.normal(size=(50, 6))
    qd /= np.linalg.norm(qd, axis=-1, keepdims=True)
    for components in ("linear", "angular"):
        found = ur5e.velocity_ellipsoid(q, components=components)
        assert found.axes.shape == (50, 3, 3)
        # Joint rates of norm 1 give tip velocities inside the manipulability ellipsoid.
        moved = np.einsum("Nij,Nj->Ni", J[:, ROWS[components]], qd)
        along = np.einsum("Nij,Ni->Nj", found.axes, moved) / found.lengths
        assert (np.linalg.norm(along, axis=-1) <= 1 + 1e-9).all()
        # The axes and lengths of the manipulability ellipsoid reproduce J J^T.
        squared = J[:, ROWS[components]] @ J[:, ROWS[components]].mT
        back = (found.axes * found.lengths[:, None] ** 2) @ found.axes.mT
        np.testing.assert_allclose(back, squared, rtol=0, atol=1e-13)
        force = ur5e.force_ellipsoid(q, components=components)
        np.testing.assert_allclose(force.lengths, 1 / found.lengths[:, ::-1], rtol=1e-12)
        np.testing.assert_array_equal(force.axes, found.axes[:, :, ::-1])
    whole = ur5e.force_ellipsoid(q, components="all")
    length = ur5e.characteristic_length
    wrench = whole.axes[..., 0] * whole.lengths[:, :1] * np.repeat([1 / length, 1], 3)
    torque = np.einsum("Nji,Nj->Ni", J, wrench)
    np.testing.assert_allclose(np.linalg.norm(torque, axis=-1), 1, rtol=1e-9)


def test_manipulability_vanishes_at_singularity(ur5e):
    q = np.array([0.3, -1.2, 0.0, -0.4, 0.9, 0.2])
    found = ur5e.manipulability(q)
    assert found.measure < 1e-15
    assert found.min_singular_value < 1e-15
    assert found.condition > 1e14
    assert np.isfinite(ur5e.manipulability_gradient(q)).all()
    straight = np.zeros(6)
    assert ur5e.manipulability(straight).condition > 1e14
    assert (ur5e.force_ellipsoid(straight, components="all").lengths > 0).all()


def test_non_finite_configuration_gives_nan_manipulability(ur5e):
    q = inside(ur5e, 3)
    q[1, 2] = np.nan
    found = ur5e.manipulability(q)
    for name in chasles.Manipulability.__slots__:
        assert np.isnan(getattr(found, name)).reshape(3, -1).all(-1).tolist() == [0, 1, 0]
    ellipsoid = ur5e.velocity_ellipsoid(q, components="all")
    assert np.isnan(ellipsoid.lengths).all(-1).tolist() == [False, True, False]
    assert np.isnan(ur5e.manipulability_gradient(q)).all(-1).tolist() == [False, True, False]
    assert np.ndim(ur5e.manipulability(q[0]).measure) == 0
    assert ur5e.manipulability(q.reshape(3, 1, 6)).singular_values.shape == (3, 1, 6)


def test_characteristic_length_is_rms_distance_from_axes(ur5e):
    """The oracle computes the distance of the tip from all axes at many random configurations."""
    q = np.random.default_rng(0).uniform(-np.pi, np.pi, (20000, 6))
    J = ur5e.jacobian_mixed(q)
    expected = np.sqrt((J[:, :3] ** 2).sum(1).mean())
    assert abs(ur5e.characteristic_length / expected - 1) < 0.01
    # A gantry does not rotate its tool, so all its singular values are close to 1.
    gantry = chasles.load("bricklaying_gantry")
    values = gantry.manipulability(inside(gantry, 10)).singular_values
    assert 0.8 < values.min() < values.max() < 1.3


def test_invalid_manipulability_arguments_are_rejected(ur5e):
    q = np.zeros(6)
    with pytest.raises(
        chasles.InputError, match=r"ur5e\.manipulability: components must be .* 'trans'"
    ):
        ur5e.manipulability(q, components="trans")
    with pytest.raises(
        chasles.InputError, match=r"ur5e\.velocity_ellipsoid: characteristic_length must be"
    ):
        ur5e.velocity_ellipsoid(q, components="linear", characteristic_length=0.0)
    with pytest.raises(chasles.ShapeError):
        ur5e.manipulability(np.zeros(5))


def test_gradient_is_missing_without_hessian(tmp_path):
    wanted = ["fk", "jacobian_mixed"]
    scara = compiled(read(description("scara")), tmp_path / "scara", wanted, ["c"])
    assert scara.manipulability(np.full(4, 0.1)).measure > 0
    with pytest.raises(AttributeError, match="'scara' has no 'manipulability_gradient'"):
        scara.manipulability_gradient  # noqa: B018


def test_platform_manipulability_uses_actuator_jacobian():
    platform = chasles.load("stewart_gough")
    q = np.array(platform.reference.q) + np.linspace(0, 0.03, 6)
    theta = platform.chain(q)
    J = platform.chain_jacobian_mixed(theta) @ np.linalg.inv(platform.actuators_D_chain(theta))
    values = platform.manipulability(q, characteristic_length=1.0).singular_values
    np.testing.assert_allclose(values, np.linalg.svd(J, compute_uv=False), rtol=1e-9)
