"""Newton's method on forward kinematics refines an approximate solution to full accuracy."""

import numpy as np
import pytest

import chasles
from chasles.closed_form.polish import _step, _twist, iterate, of_pose
from tests.support.handwritten import scara

LONGER = 0.003
"""Length in meters by which the true upper arm is longer than the nominal upper arm."""
SIX = ["ur5e", "puma560"]


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    path = tmp_path_factory.mktemp("calibrated") / "scara"
    folder = scara.write(path, scara.A1 + LONGER)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CHASLES_CACHE", str(path.parent / "cache"))
        return chasles.load(folder.path)


def reachable(n, seed=0):
    rng = np.random.default_rng(seed)
    return rng.uniform([-3, 0.2, -0.5, -3], [3, 2.4, 0.5, 3], (n, 4))


def errors(robot, q, T):
    """Return distances and rotation angles between fk(q) and T, by an independent formula."""
    here = robot.fk(q)
    linear = np.linalg.norm(here[..., :3, 3] - T[..., :3, 3], axis=-1)
    chord = np.linalg.norm(here[..., :3, :3] - T[..., :3, :3], axis=(-2, -1))
    return np.stack([linear, 2 * np.arcsin(np.minimum(chord / 8**0.5, 1))])


def error(robot, q, T):
    """Return the larger of the distance and the angle between two poses."""
    return errors(robot, q, T).max(0)


def polish(robot, T, q, fixed=()):
    """Refine q toward the pose T, and return the coordinates and residuals."""
    found = q.copy()
    return found, iterate(robot.fk_jacobian_mixed, of_pose, T, found, fixed)


# -------------------------------------------------------------------- polish


@pytest.mark.parametrize("name", [*SIX, "panda", "stanford", "scara"])
def test_newton_refinement_converges_from_nearby_configuration(name):
    robot = chasles.load(name)
    rng = np.random.default_rng(1)
    q = rng.uniform(-1, 1, (500, robot.n)) + 0.3
    T = robot.fk(q)
    found, residual = polish(robot, T, q + rng.uniform(-5e-3, 5e-3, q.shape))
    assert (residual < 1e-9).mean() > 0.99
    good = residual < 1e-9
    assert np.median(residual) < 1e-14
    np.testing.assert_allclose(residual[good], error(robot, found, T)[good], atol=1e-12)
    if robot.n <= 6:
        assert np.median(np.abs(found - q).max(-1)) < 1e-12


def test_residual_angle_is_accurate_near_zero_and_pi():
    # Near 0 and pi, the sine or the cosine alone would not determine the angle of the residual
    # accurately.
    robot = chasles.load("ur5e")
    q = np.array([0.3, -1.0, 1.2, 0.4, 0.8, 0.1])
    turned = q + np.array([0, 0, 0, 0, 0, 1.0])[:, None].T * np.array([[np.pi - 1e-3], [1e-7], [2]])
    twist, residual = _twist(robot.fk(turned), np.broadcast_to(robot.fk(q), (3, 4, 4)))
    np.testing.assert_allclose(residual, [np.pi - 1e-3, 1e-7, 2], atol=1e-14)
    axis = robot.fk(q)[:3, 2]
    np.testing.assert_allclose(twist[:, 3:], -residual[:, None] * axis, atol=1e-12)


@pytest.mark.parametrize("many", [5, 200])
def test_newton_step_solves_damped_normal_equations(many):
    rng = np.random.default_rng(2)
    for n in (4, 6, 7):
        J, e = rng.normal(size=(many, 6, n)), rng.normal(size=(many, 6)) * 1e-2
        damping = (e * e).sum(-1)
        expected = J.mT @ np.linalg.solve(
            J @ J.mT + damping[:, None, None] * np.eye(6), e[..., None]
        )
        largest = np.abs(expected).max((1, 2))
        assert (largest < 0.3).any()
        scale = 0.3 / np.maximum(largest, 0.3)
        np.testing.assert_allclose(
            _step(J, e, damping), scale[:, None] * expected[..., 0], atol=1e-10
        )


def test_every_row_of_large_batch_converges(arm):
    q = reachable(10_000)
    T = arm.fk(q)
    assert polish(arm, T, q + 1e-3)[1].max() < 1e-13


def test_refinement_never_increases_error(arm):
    q = reachable(2000)
    T = arm.fk(q)
    T[:, :2, 3] *= np.random.default_rng(3).uniform(0.2, 4.0, (2000, 1))
    start = q + np.random.default_rng(5).uniform(-1.0, 1.0, q.shape)
    before = np.hypot(*errors(arm, start, T))
    found, residual = polish(arm, T, start)
    assert (np.hypot(*errors(arm, found, T)) <= before + 1e-12).all()
    np.testing.assert_allclose(residual, error(arm, found, T), atol=1e-12)
    assert 0.02 < (residual < 1e-9).mean() < 0.9


def test_fixed_coordinates_keep_their_values():
    panda = chasles.load("panda")
    q = np.random.default_rng(6).uniform(-1, 1, (200, 7)) - np.array([0, 0, 0, 1.5, 0, -1.5, 0])
    start = q + np.array([2e-3] * 5 + [0, 2e-3])
    found, residual = polish(panda, panda.fk(q), start, fixed=[6])
    assert (residual < 1e-13).mean() > 0.99
    np.testing.assert_array_equal(found[:, 6], start[:, 6])


def test_refinement_stays_bounded_at_singularity():
    robot = chasles.load("ur5e")
    rng = np.random.default_rng(4)
    q = rng.uniform(-1.5, 1.5, (300, 6))
    q[:, 4] = 0.0
    found, residual = polish(robot, robot.fk(q), q + rng.uniform(-1e-3, 1e-3, q.shape))
    assert (residual < 1e-9).mean() > 0.9
    assert np.abs(found - q).max() < 1.0


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_non_finite_input_never_converges_or_affects_other_rows(arm, bad):
    q = reachable(3)
    T = arm.fk(q)
    T[1, 0, 3] = bad
    q[2, 1] = bad
    found, residual = polish(arm, T, q)
    assert np.isnan(residual[2])
    assert np.isnan(found[2]).all()
    assert not residual[1] < 1e-9
    assert residual[0] < 1e-14
    none, left = polish(arm, T[:0], q[:0])
    assert (none.shape, left.shape) == ((0, 4), (0,))


def test_ik_refine_recovers_configurations_of_poses():
    for name in ("ur5e", "panda", "excavator"):
        robot = chasles.load(name)
        q = robot.random_q((2, 5), rng=3)
        T = robot.fk(q)
        found, residual = robot.ik_refine(T, q + 1e-3 * np.array([1, -1] * 4)[: robot.n])
        assert (found.shape, residual.shape) == (q.shape, (2, 5))
        assert residual.max() < 1e-12
        np.testing.assert_allclose(robot.fk(found), T, atol=1e-11)
    one = robot.ik_refine(T[0, 0], q[0, 0])
    assert (one.q.shape, np.ndim(one.residual)) == ((robot.n,), 0)
    far = robot.ik_refine(T[0, 0] + 9 * np.eye(4, k=3), q[0, 0])
    assert far.residual > 1
    with pytest.raises(chasles.ShapeError, match="q_seed must have shape"):
        robot.ik_refine(T[0, 0], q[0, 0, 1:])
