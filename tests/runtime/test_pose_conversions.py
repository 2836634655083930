"""Pose conversions agree with SciPy, and the adjoint agrees with the exponential."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import chasles
from chasles import se3

ROTATIONS = Rotation.random(200, random_state=1)
XYZ = np.random.default_rng(2).normal(size=(200, 3))
T = se3.pose(XYZ, rotation=ROTATIONS)


def test_orientations_equal_those_of_scipy():
    R, quat = ROTATIONS.as_matrix(), ROTATIONS.as_quat()
    for pose in (
        T,
        se3.pose(XYZ, rotation=R),
        se3.pose(XYZ, quat=3 * quat, order="xyzw"),
        se3.pose(XYZ, quat=np.roll(quat, 1, -1), order="wxyz"),
        se3.pose(XYZ, rpy=ROTATIONS.as_euler("xyz")),
        se3.pose(XYZ, rotvec=ROTATIONS.as_rotvec()),
    ):
        np.testing.assert_allclose(pose[:, :3, :3], R, atol=1e-14)
        np.testing.assert_array_equal(pose[:, :3, 3], XYZ)
        np.testing.assert_array_equal(pose[:, 3], np.broadcast_to([0, 0, 0, 1.0], (200, 4)))


def test_conversions_invert_the_keywords_of_pose():
    quat = ROTATIONS.as_quat(canonical=True)
    np.testing.assert_array_equal(se3.to_xyz(T), XYZ)
    np.testing.assert_array_equal(se3.to_rotation(T), ROTATIONS.as_matrix())
    np.testing.assert_allclose(se3.to_quat(T, order="xyzw"), quat, atol=1e-14)
    np.testing.assert_allclose(se3.to_quat(T, order="wxyz"), np.roll(quat, 1, -1), atol=1e-14)
    np.testing.assert_allclose(se3.to_rpy(T), ROTATIONS.as_euler("xyz"), atol=1e-13)
    np.testing.assert_allclose(se3.to_rotvec(T), ROTATIONS.as_rotvec(), atol=1e-13)


def test_half_turns_and_upright_tools_are_converted():
    for rpy in (
        [0, np.pi / 2, 0.4],
        [0.3, -np.pi / 2, 0.2],
        [np.pi, 0, 0],
        [0, 0, np.pi],
        [0, 0, 0],
    ):
        pose = se3.pose(rpy=rpy)
        np.testing.assert_allclose(se3.pose(rpy=se3.to_rpy(pose)), pose, atol=1e-12)
        again = se3.pose(quat=se3.to_quat(pose, order="wxyz"), order="wxyz")
        np.testing.assert_allclose(again, pose, atol=1e-12)


def test_positions_and_orientations_broadcast():
    assert se3.pose().tolist() == np.eye(4).tolist()
    assert se3.pose([1, 2, 3]).shape == (4, 4)
    assert se3.pose(np.zeros((5, 1, 3)), rpy=np.zeros((7, 3))).shape == (5, 7, 4, 4)


def test_ambiguous_orientations_are_rejected():
    with pytest.raises(chasles.InputTypeError, match="expected one orientation, got quat, rpy"):
        se3.pose(quat=[0, 0, 0, 1], rpy=[0, 0, 0])
    with pytest.raises(chasles.InputTypeError, match='pass order="wxyz" or order="xyzw"'):
        se3.pose(quat=[0, 0, 0, 1])
    with pytest.raises(chasles.InputValueError, match=r"expected order .*, got 'xyz'"):
        se3.to_quat(T, order="xyz")
    with pytest.raises(chasles.InputValueError, match="quat is 0"):
        se3.pose(quat=[0, 0, 0, 0], order="wxyz")
    with pytest.raises(chasles.ShapeError, match=r"se3\.pose: expected rpy of shape \(\.\.\., 3\)"):
        se3.pose(rpy=[0, 0])


def test_adjoint_expresses_twists_in_another_frame():
    V = np.random.default_rng(3).normal(size=(200, 6))
    moved = se3.exp((se3.adjoint(T) @ V[..., None])[..., 0])
    np.testing.assert_allclose(moved, T @ se3.exp(V) @ se3.inverse(T), atol=1e-12)
    product = se3.adjoint(T[0]) @ se3.adjoint(T[1])
    np.testing.assert_allclose(se3.adjoint(T[0] @ T[1]), product, atol=1e-12)


def test_swap_twist_order_exchanges_halves():
    assert se3.swap_twist_order([1, 2, 3, 4, 5, 6]).tolist() == [4, 5, 6, 1, 2, 3]
