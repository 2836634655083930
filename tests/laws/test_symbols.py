"""Symbolic results: the functions that they contain, correctness, and float64 accuracy."""

import math

import mpmath
import numpy as np
import pytest
from sympy import Abs, Expr, Function, Pow, atan2, cos, lambdify, pi, sin, sqrt, symbols, zeros

from . import lie
from .oracles import AXES, LAW_TOLERANCE, expm, twists, vector, wide

X = lie.Matrix(symbols("v1:4 omega1:4", real=True))
OMEGA = X[3:, :]
T = lie.Matrix(4, 4, [*symbols("r11:14 p1 r21:24 p2 r31:34 p3", real=True), 0, 0, 0, 1])
q = symbols("q", real=True)

OF_TWIST = {
    "exp_se3": lie.exp_se3(X),
    "dexp_left_se3": lie.dexp_left_se3(X),
    "dexp_right_se3": lie.dexp_right_se3(X),
    "dexp_left_inverse_se3": lie.dexp_left_inverse_se3(X),
    "dexp_right_inverse_se3": lie.dexp_right_inverse_se3(X),
}
LOGARITHM = lie.log_se3(T)


def matrix(values: object) -> np.ndarray:
    return np.array(values, dtype=float)


def numbers(M: lie.Matrix | mpmath.matrix) -> np.ndarray:
    return matrix((M if isinstance(M, mpmath.matrix) else wide(M)).tolist())


@pytest.mark.parametrize("result", [*OF_TWIST.values(), LOGARITHM], ids=[*OF_TWIST, "log_se3"])
def test_results_use_only_functions_that_can_be_lowered(result: lie.Matrix) -> None:
    """The absolute values of exponents are at most 2."""
    assert {type(f) for f in result.atoms(Function)} <= {sin, cos, atan2}
    kinds = {type(e).__name__ for entry in result for e in walk(entry)}
    assert kinds - {"sin", "cos", "atan2"} <= {
        *("Add", "Mul", "Pow", "Symbol", "Integer", "Rational"),
        *("Zero", "One", "NegativeOne", "Half"),
    }
    exponents = {p.exp for p in result.atoms(Pow)}
    assert all((2 * e).is_integer and abs(e) <= 2 for e in exponents)


def walk(e: Expr) -> list[Expr]:
    return [e, *(part for argument in e.args for part in walk(argument))]


def test_fixed_axes_give_plain_functions_of_the_angle() -> None:
    """For the rotation vector (0, 0, q), even functions of its length contain q, not Abs(q)."""
    R = lie.exp_so3(lie.Matrix([0, 0, q]))
    assert lie.Matrix([[cos(q), -sin(q), 0], [sin(q), cos(q), 0], [0, 0, 1]]) == R
    assert lie.log_so3(R) == lie.Matrix([0, 0, atan2(sin(q), cos(q), evaluate=False)])
    for function in (lie.exp_se3, lie.dexp_left_se3, lie.dexp_left_inverse_se3):
        assert not function(lie.Matrix([1, 2, 3, q / sqrt(2), 0, -q / sqrt(2)])).has(Abs)


def test_symbolic_exp_and_log_hold_at_negative_angles() -> None:
    checked = 0
    for value in (-pi / 3, -pi / 2, -2 * pi / 3, pi / 4):
        for axis in (lie.Matrix([0, 0, 1]), lie.Matrix([1, -1, 0]) / sqrt(2)):
            symbolic, number = q * axis, value * axis
            assert (lie.exp_so3(symbolic).subs(q, value) - lie.exp_so3(number)).expand() == zeros(3)
            logarithm = lie.log_so3(lie.exp_so3(symbolic)).subs(q, value)
            assert (logarithm - number).expand() == zeros(3, 1)
            checked += 1
    assert checked == 8


def test_symbolic_and_numeric_branches_agree() -> None:
    """The results for symbols agree with exact numbers at 30-digit precision."""
    checked = 0
    for x in (lie.Matrix([1, 2, -1, 1, -2, 2]) / 2, lie.Matrix([0, 3, 1, 4, 0, -3]) / 5):
        values = dict(zip(X, x, strict=True))
        for name, expression in OF_TWIST.items():
            difference = expression.subs(values).n(30) - getattr(lie, name)(x).n(30)
            assert max(map(abs, difference)) < 1e-28
            checked += 1
    assert checked == 10


def test_lowered_exp_keeps_its_digits_at_small_angles() -> None:
    """Test float64 accuracy from 1e-150 radian to beyond pi. Zero is undefined."""
    function = lambdify([*X], OF_TWIST["exp_se3"], modules="numpy")
    checked = 0
    for x in twists([1e-150, 1e-100, 1e-8, 1e-4, 0.3, 3.0, math.pi, 4.0]):
        result = matrix(function(*map(float, x)))
        assert np.abs(result - numbers(expm(lie.hat_se3(x)))).max() <= LAW_TOLERANCE
        checked += 1
    assert checked == 32


def test_lowered_dexp_so3_keeps_its_digits_at_small_angles() -> None:
    checked = 0
    for name in ("dexp_left_so3", "dexp_right_inverse_so3"):
        function = lambdify([*OMEGA], getattr(lie, name)(OMEGA), modules="numpy")
        for angle in (1e-8, 1e-4, 0.3, 3.0, math.pi, 4.0):
            for axis in AXES:
                omega = vector(*(angle * c for c in axis))
                result = matrix(function(*map(float, omega)))
                assert np.abs(result - numbers(getattr(lie, name)(omega))).max() <= LAW_TOLERANCE
                checked += 1
    assert checked == 48


def test_lowered_dexp_se3_loses_digits_as_epsilon_over_the_angle() -> None:
    checked = 0
    for name in list(OF_TWIST)[1:]:
        function = lambdify([*X], OF_TWIST[name], modules="numpy")
        for angle in (1e-6, 1e-4, 1e-2, 0.3, 3.0):
            for x in twists([angle]):
                result = matrix(function(*map(float, x)))
                error = np.abs(result - numbers(getattr(lie, name)(x))).max()
                assert error <= 8 * np.finfo(float).eps * max(1 / angle, 4)
                checked += 1
    assert checked == 80


def test_lowered_log_undoes_exp() -> None:
    """The tested angles are away from pi, where the symbolic logarithm is undefined."""
    function = lambdify([*T[:3, :]], LOGARITHM, modules="numpy")
    checked = 0
    for x in twists([1e-8, 1e-4, 0.3, 2.0, 3.0]):
        result = matrix(function(*map(float, lie.exp_se3(x)[:3, :])))
        assert np.abs(result - numbers(x)).max() <= LAW_TOLERANCE
        checked += 1
    assert checked == 20
