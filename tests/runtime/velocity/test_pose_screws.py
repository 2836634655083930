"""se3 and so3 agree with 30-digit arithmetic, SciPy and the symbolic code."""

import mpmath
import numpy as np
import pytest

import chasles
from chasles import se3, so3
from tests.support.optional import OptionalPackage

transform = OptionalPackage("scipy.spatial.transform")

ANGLES = [0.0, 1e-200, 1e-12, 1e-8, 1e-4, 0.2499, 0.25, 0.2501, 1.0, np.pi / 2, 2.0, 3.0]
ANGLES += [np.pi - 1e-4, np.pi - 1e-8, np.pi - 1e-12]
RNG = np.random.default_rng(7)


def twists(angle, count=40):
    axis = RNG.normal(size=(count, 3))
    axis[-6:] = np.concatenate([np.eye(3), -np.eye(3)])[-count:]
    axis /= np.linalg.norm(axis, axis=-1)[:, None]
    return np.concatenate([RNG.uniform(-2, 2, (count, 3)), angle * axis], -1)


def exact_exp(twist):
    """Return the matrix exponential of a twist, computed at 40-digit precision and rounded."""
    with mpmath.workdps(40):
        v = [mpmath.mpf(float(x)) for x in twist]
        x, y, z = v[3:]
        X = mpmath.matrix([[0, -z, y, v[0]], [z, 0, -x, v[1]], [-y, x, 0, v[2]], [0] * 4])
        T = mpmath.expm(X, method="taylor")
        return np.array(T.tolist(), dtype=float)


@pytest.mark.parametrize("angle", [*ANGLES, 4.0, 7.0])
def test_exp_matches_30_digit_reference(angle):
    x = twists(angle, 12)
    np.testing.assert_allclose(se3.exp(x), [exact_exp(row) for row in x], rtol=0, atol=4e-15)


@pytest.mark.parametrize("angle", ANGLES)
def test_log_inverts_exp(angle):
    # The oracle is computed at 40-digit precision and rounded, so it is independent of se3.exp.
    x = twists(angle, 12)
    T = np.array([exact_exp(row) for row in x])
    np.testing.assert_allclose(se3.log(T), x, rtol=0, atol=1e-14)
    np.testing.assert_allclose(se3.exp(se3.log(T)), T, rtol=0, atol=1e-14)


def test_small_angles_keep_their_digits():
    x = twists(1e-8)
    np.testing.assert_allclose(se3.log(se3.exp(x))[:, 3:], x[:, 3:], rtol=0, atol=1e-22)


def test_log_of_half_turn_reproduces_pose():
    x = twists(np.pi)
    again = se3.log(se3.exp(x))
    np.testing.assert_allclose(np.linalg.norm(again[:, 3:], axis=-1), np.pi, rtol=1e-15)
    np.testing.assert_allclose(se3.exp(again), se3.exp(x), atol=4e-15)
    exact = np.diag([-1.0, -1.0, 1.0, 1.0])
    np.testing.assert_array_equal(se3.log(exact), [0, 0, 0, 0, 0, np.pi])


def test_log_angle_is_at_most_pi():
    checked = 0
    for angle in np.linspace(0, 12, 61):
        x = se3.log(se3.exp(twists(angle)))
        expected = abs((angle + np.pi) % (2 * np.pi) - np.pi)
        np.testing.assert_allclose(np.linalg.norm(x[:, 3:], axis=-1), expected, atol=1e-14)
        checked += 1
    assert checked == 61


def test_exp_and_log_agree_with_scipy():
    T = se3.exp(twists(2.0, 200))
    rigid = transform.RigidTransform.from_matrix(T)
    expected = rigid.as_exp_coords()  # (omega, v)
    np.testing.assert_allclose(se3.log(T)[:, [3, 4, 5, 0, 1, 2]], expected, atol=1e-12)
    turns = transform.Rotation.from_matrix(T[:, :3, :3])
    np.testing.assert_allclose(so3.log(T[:, :3, :3]), turns.as_rotvec(), atol=1e-13)
    np.testing.assert_allclose(se3.inverse(T), np.linalg.inv(T), atol=1e-14)


def test_exp_and_log_agree_with_symbolic_implementation():
    pytest.importorskip("sympy")
    from tests.laws import lie

    x = twists(1.3, 9)[:3]
    for row in x:
        T = np.array(lie.exp_se3(lie.Matrix(row.tolist()))).astype(float)
        np.testing.assert_allclose(se3.exp(row), T, atol=1e-14)
        back = np.array(lie.log_se3(lie.Matrix(T.tolist()))).astype(float)[:, 0]
        np.testing.assert_allclose(se3.log(T), back, atol=1e-12)


def test_screw_interpolation_has_constant_twist():
    T_a, T_b = se3.exp(twists(1.0, 8)[:2])
    s = np.linspace(0, 1, 11)
    path = se3.interpolate(T_a, T_b, s)
    np.testing.assert_array_equal(path[0], T_a)
    np.testing.assert_allclose(path[-1], T_b, atol=4e-15)
    steps = se3.log(se3.inverse(path[:-1]) @ path[1:])
    np.testing.assert_allclose(steps, np.broadcast_to(steps[0], steps.shape), atol=1e-14)
    # Every frame on the same body follows the same screw motion.
    T_b_c = se3.exp(twists(0.7, 8)[0])
    other = se3.interpolate(T_a @ T_b_c, T_b @ T_b_c, s)
    np.testing.assert_allclose(other, path @ T_b_c, atol=1e-14)


def test_straight_interpolation_rotates_about_fixed_axis():
    T_a, T_b = se3.exp(twists(1.0, 8)[:2])
    s = np.linspace(0, 1, 11)
    path = se3.interpolate_straight(T_a, T_b, s)
    np.testing.assert_array_equal(path[0], T_a)
    np.testing.assert_allclose(path[-1], T_b, atol=4e-15)
    ahead = T_b[:3, 3] - T_a[:3, 3]
    np.testing.assert_allclose(path[:, :3, 3], T_a[:3, 3] + s[:, None] * ahead, atol=1e-15)
    R = path[:, :3, :3]
    turns = so3.log(R[1:] @ np.swapaxes(R[:-1], -1, -2))  # base axes
    np.testing.assert_allclose(turns, np.broadcast_to(turns[0], turns.shape), atol=1e-14)


@pytest.mark.parametrize(
    "way", [se3.interpolate, se3.interpolate_straight], ids=["screw", "straight"]
)
def test_interpolations_broadcast_over_poses_and_parameters(way):
    T_a, T_b = se3.exp(twists(1.0, 9)[:4]), se3.exp(twists(2.0, 9)[:4])
    s = np.linspace(-0.5, 1.5, 5)
    paths = way(T_a, T_b, s[:, None])
    assert paths.shape == (5, 4, 4, 4)
    for i, part in enumerate(s):
        for j in range(4):
            np.testing.assert_allclose(paths[i, j], way(T_a[j], T_b[j], part), atol=1e-15)
    assert way(T_a[0], T_b[0], 0.5).shape == (4, 4)


def test_screw_functions_check_shapes_and_propagate_nan():
    with pytest.raises(chasles.ShapeError, match=r"se3.exp: expected twist of shape"):
        se3.exp(np.zeros(5))
    with pytest.raises(chasles.ShapeError, match=r"se3.interpolate_straight: expected T_b"):
        se3.interpolate_straight(np.eye(4), np.eye(3), 0.5)
    assert np.isnan(se3.log(np.full((4, 4), np.nan))).all()
    assert se3.log(np.zeros((0, 4, 4))).shape == (0, 6)
