"""hat, vee, the bracket, and the order of twist components."""

from collections.abc import Callable

import pytest
from sympy import Integer, Matrix, Symbol, eye, symbols, zeros

from . import lie
from .oracles import assert_close, pairs, random_twists

X = lie.Matrix(symbols("v1:4 omega1:4", real=True))
Y = lie.Matrix(symbols("u1:4 nu1:4", real=True))
Z = lie.Matrix(symbols("w1:4 mu1:4", real=True))


def test_vee_undoes_hat() -> None:
    assert lie.vee_so3(lie.hat_so3(X[3:, :])) == X[3:, :]
    assert lie.vee_se3(lie.hat_se3(X)) == X


def test_hat_so3_is_the_cross_product() -> None:
    a, b = X[3:, :], Y[3:, :]
    assert lie.hat_so3(a) * b == a.cross(b)
    assert -lie.hat_so3(a) == lie.hat_so3(a).T


def test_hat_se3_is_linear_part_first() -> None:
    e = lie.hat_se3(lie.Matrix([1, 2, 3, 4, 5, 6]))
    assert e == lie.Matrix([[0, -6, 5, 1], [6, 0, -4, 2], [-5, 4, 0, 3], [0, 0, 0, 0]])


def test_ad_is_the_bracket() -> None:
    bracket = lie.hat_se3(X) * lie.hat_se3(Y) - lie.hat_se3(Y) * lie.hat_se3(X)
    assert (lie.ad(X) * Y - lie.vee_se3(bracket)).expand() == zeros(6, 1)
    assert bracket.expand() == lie.hat_se3(lie.ad(X) * Y).expand()


def test_bracket_is_antisymmetric() -> None:
    assert (lie.ad(X) * Y + lie.ad(Y) * X).expand() == zeros(6, 1)
    assert (lie.ad(X) * X).expand() == zeros(6, 1)


def test_bracket_satisfies_jacobi_identity() -> None:
    cyclic = sum(
        (lie.ad(a) * lie.ad(b) * c for a, b, c in ((X, Y, Z), (Y, Z, X), (Z, X, Y))), zeros(6, 1)
    )
    assert cyclic.expand() == zeros(6, 1)
    assert (lie.ad(X) * Y).expand() != zeros(6, 1)


def test_ad_of_a_bracket_is_the_commutator() -> None:
    commutator = lie.ad(X) * lie.ad(Y) - lie.ad(Y) * lie.ad(X)
    assert (lie.ad(lie.ad(X) * Y) - commutator).expand() == zeros(6, 6)


def test_swap_twist_order_exchanges_halves_and_is_involution() -> None:
    assert lie.swap_twist_order(X) == lie.Matrix([*X[3:, 0], *X[:3, 0]])
    jacobian = lie.Matrix.hstack(X, Y)
    swapped = lie.swap_twist_order(jacobian)
    assert swapped[:, 1] == lie.swap_twist_order(Y)
    assert lie.swap_twist_order(swapped) == jacobian


def test_swapped_adjoint_matches_lynch_and_park() -> None:
    """In the order (omega, v), Ad is [[R, 0], [hat(p) R, R]] (Lynch and Park, definition 3.20)."""
    checked = 0
    for x, y in pairs(random_twists(5, seed=1)):
        T = lie.exp_se3(x)
        R, p = lie.rotation(T), lie.translation(T)
        A = lie.swap_twist_order(lie.swap_twist_order(lie.adjoint(T)).T).T
        assert lie.Matrix([[R, zeros(3, 3)], [lie.hat_so3(p) * R, R]]) == A
        image = lie.swap_twist_order(lie.adjoint(T) * y)
        assert_close(A * lie.swap_twist_order(y), image, x)
        checked += 1
    assert checked == 5


def test_results_are_immutable() -> None:
    mutable = Matrix([1, 2, 3, 4, 5, 6])
    T = eye(4)
    results = [
        lie.hat_so3(mutable[:3, :]),
        lie.vee_so3(eye(3)),
        lie.hat_se3(mutable),
        lie.vee_se3(T),
        lie.swap_twist_order(mutable),
        lie.pose(eye(3), zeros(3, 1)),
        lie.rotation(T),
        lie.translation(T),
        lie.inverse_se3(T),
        lie.adjoint(T),
        lie.ad(mutable),
        lie.exp_so3(zeros(3, 1)),
        lie.exp_so3(mutable[:3, :]),
        lie.log_so3(eye(3)),
        lie.log_so3(Matrix([[0, -1, 0], [1, 0, 0], [0, 0, 1]])),
        lie.log_so3(Matrix([[-1, 0, 0], [0, -1, 0], [0, 0, 1]])),
        lie.exp_se3(mutable),
        lie.log_se3(T),
        lie.screw_axis(Matrix([0, 0, 1]), zeros(3, 1)),
        lie.screw_axis(Matrix([0, 0, 1]), zeros(3, 1), Integer(2)),
        lie.exp_screw(Matrix([0, 0, 0, 0, 0, 1]), Symbol("q")),
        lie.exp_screw(Matrix([0, 0, 1, 0, 0, 0]), Symbol("q")),
        lie.dexp_left_so3(mutable[:3, :]),
        lie.dexp_right_so3(mutable[:3, :]),
        lie.dexp_left_inverse_so3(mutable[:3, :]),
        lie.dexp_right_inverse_so3(mutable[:3, :]),
        lie.dexp_left_se3(mutable),
        lie.dexp_right_se3(mutable),
        lie.dexp_left_inverse_se3(mutable),
        lie.dexp_right_inverse_se3(mutable),
    ]
    assert [type(M) for M in results] == [lie.Matrix] * 30


@pytest.mark.parametrize(
    ("function", "shape"),
    [
        (lie.hat_so3, (3, 1)),
        (lie.vee_so3, (3, 3)),
        (lie.hat_se3, (6, 1)),
        (lie.vee_se3, (4, 4)),
        (lie.rotation, (4, 4)),
        (lie.translation, (4, 4)),
        (lie.inverse_se3, (4, 4)),
        (lie.adjoint, (4, 4)),
        (lie.ad, (6, 1)),
        (lie.exp_so3, (3, 1)),
        (lie.log_so3, (3, 3)),
        (lie.exp_se3, (6, 1)),
        (lie.log_se3, (4, 4)),
        (lie.dexp_left_so3, (3, 1)),
        (lie.dexp_right_inverse_se3, (6, 1)),
    ],
    ids=lambda value: value.__name__ if callable(value) else "x".join(map(str, value)),
)
def test_a_wrong_shape_is_named(
    function: Callable[[lie.Matrix], lie.Matrix], shape: tuple[int, int]
) -> None:
    with pytest.raises(ValueError, match=r"has shape \(2, 5\): expected") as raised:
        function(zeros(2, 5))
    assert str(shape) in str(raised.value)


def test_a_wrong_number_of_rows_is_named() -> None:
    with pytest.raises(ValueError, match=r"twists has shape \(5, 2\): expected \(6, 2\)"):
        lie.swap_twist_order(zeros(5, 2))
    with pytest.raises(ValueError, match=r"p has shape \(4, 1\): expected \(3, 1\)"):
        lie.pose(eye(3), zeros(4, 1))
