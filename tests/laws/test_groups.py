"""Group axioms of SE(3) and the adjoint representation."""

from sympy import Float, Matrix, diff, eye, symbols, zeros

from . import lie
from .oracles import (
    ANGLES,
    assert_close,
    expm,
    few_twists,
    pairs,
    random_poses,
    random_twists,
)

POSES = random_poses(4, seed=2)


def test_pose_product_is_closed_and_associative() -> None:
    checked = 0
    for (A, B), (_, C) in zip(pairs(POSES), pairs(POSES[1:] + POSES[:1]), strict=True):
        assert_close((A * B) * C, A * (B * C))
        R = lie.rotation(A * B)
        assert_close(R.T * R, eye(3))
        assert abs(R.det() - 1) < Float("1e-12")
        assert (A * B)[3, :] == Matrix([[0, 0, 0, 1]])
        checked += 1
    assert checked == 4


def test_pose_times_its_inverse_is_identity() -> None:
    checked = 0
    for T in [*POSES, *map(lie.exp_se3, few_twists(ANGLES))]:
        assert_close(T * lie.inverse_se3(T), eye(4), T)
        assert_close(lie.inverse_se3(T) * T, eye(4), T)
        assert_close(lie.inverse_se3(lie.inverse_se3(T)), T, T)
        checked += 1
    assert checked == 4 + 13
    assert lie.inverse_se3(eye(4)) == eye(4)


def test_inverse_of_a_product_reverses_the_order() -> None:
    checked = 0
    for A, B in pairs(POSES):
        assert_close(lie.inverse_se3(A * B), lie.inverse_se3(B) * lie.inverse_se3(A))
        checked += 1
    assert checked == 4


def test_pose_is_rebuilt_from_rotation_and_translation() -> None:
    T = lie.Matrix(4, 4, [*symbols("r11:14 px r21:24 py r31:34 pz"), 0, 0, 0, 1])
    assert lie.pose(lie.rotation(T), lie.translation(T)) == T
    assert lie.translation(T) == lie.Matrix(symbols("px py pz"))


def test_adjoint_is_a_homomorphism() -> None:
    checked = 0
    for A, B in pairs(POSES):
        assert_close(lie.adjoint(A * B), lie.adjoint(A) * lie.adjoint(B))
        assert_close(lie.adjoint(A) * lie.adjoint(lie.inverse_se3(A)), eye(6))
        checked += 1
    assert checked == 4
    assert lie.adjoint(eye(4)) == eye(6)


def test_adjoint_is_conjugation() -> None:
    checked = 0
    for T, x in zip(POSES, random_twists(4, seed=3), strict=True):
        conjugated = T * lie.hat_se3(x) * lie.inverse_se3(T)
        assert_close(conjugated, lie.hat_se3(lie.adjoint(T) * x))
        checked += 1
    assert checked == 4


def test_adjoint_of_exp_is_exp_of_ad() -> None:
    checked = 0
    for x in [*few_twists(ANGLES), *random_twists(4, seed=4)]:
        assert_close(lie.adjoint(lie.exp_se3(x)), expm(lie.ad(x)), x)
        checked += 1
    assert checked == 13 + 4


def test_conjugated_exp_is_exp_of_adjoint() -> None:
    checked = 0
    for T, x in zip(POSES, random_twists(4, seed=5), strict=True):
        conjugated = T * lie.exp_se3(x) * lie.inverse_se3(T)
        assert_close(conjugated, lie.exp_se3(lie.adjoint(T) * x))
        checked += 1
    assert checked == 4


def test_ad_is_the_derivative_of_adjoint() -> None:
    """At the identity, d/dt Ad(exp(t x)) = ad(x) for screws x."""
    t, px, py, pz = symbols("t px py pz", real=True)
    point = lie.Matrix([px, py, pz])
    directions = [(1, 0, 0), (0, 0, 1), ("2/7", "-3/7", "6/7"), ("3/5", 0, "-4/5")]
    checked = 0
    for direction in directions:
        screw = lie.screw_axis(lie.Matrix(direction), point, symbols("h"))
        slope = diff(lie.adjoint(lie.exp_screw(screw, t)), t).subs(t, 0)
        assert (slope - lie.ad(screw)).expand() == zeros(6, 6)
        checked += 1
    assert checked == 4
