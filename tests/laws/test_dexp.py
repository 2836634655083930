"""The differential of exp, and its inverse, agree with power series and finite differences."""

import mpmath
import pytest
from sympy import Float, Rational, bernoulli, eye, pi, sqrt, zeros

from . import lie
from .oracles import (
    ANGLES,
    DIGITS,
    assert_close,
    dexp_series,
    few_twists,
    power_series,
    random_twists,
    vector,
    wide,
)

TWISTS = [*few_twists(ANGLES), *random_twists(4, seed=10)]


def test_dexp_is_its_series() -> None:
    checked = 0
    for x in TWISTS:
        series = dexp_series(lie.ad(x))
        assert_close(lie.dexp_left_se3(x), series, x)
        assert_close(lie.dexp_left_so3(x[3:, :]), series[:3, :3], x)
        checked += 1
    assert checked == 13 + 4
    for x in random_twists(3, seed=14):
        series = dexp_series(-lie.ad(x))
        assert_close(lie.dexp_right_se3(x), series, x)
        assert_close(lie.dexp_right_so3(x[3:, :]), series[:3, :3], x)
        checked += 1
    assert checked == 13 + 4 + 3


def test_dexp_inverse_is_its_bernoulli_series() -> None:
    """The series is the sum of B_k ad^k / k! with B_1 = -1/2. The series converges below 2 pi."""

    def coefficient(k: int) -> mpmath.mpf:
        number = -Rational(1, 2) if k == 1 else bernoulli(k)
        return mpmath.mpf(int(number.p)) / int(number.q) / mpmath.factorial(k)

    checked = 0
    for x in [*few_twists([0.0, 1e-8, 0.3, 1 - 1e-9, 1 + 1e-9]), *random_twists(4, seed=11)]:
        assert_close(lie.dexp_left_inverse_se3(x), power_series(wide(lie.ad(x)), coefficient), x)
        checked += 1
    assert checked == 5 + 4


def test_dexp_inverse_times_dexp_is_identity() -> None:
    checked = 0
    for x in TWISTS:
        assert_close(lie.dexp_left_inverse_se3(x) * lie.dexp_left_se3(x), eye(6), x)
        assert_close(lie.dexp_right_se3(x) * lie.dexp_right_inverse_se3(x), eye(6), x)
        omega = x[3:, :]
        assert_close(lie.dexp_left_inverse_so3(omega) * lie.dexp_left_so3(omega), eye(3), x)
        assert_close(lie.dexp_right_so3(omega) * lie.dexp_right_inverse_so3(omega), eye(3), x)
        checked += 1
    assert checked == 13 + 4


def test_left_dexp_is_adjoint_of_exp_times_right_dexp() -> None:
    checked = 0
    for x in TWISTS:
        T = lie.exp_se3(x)
        assert_close(lie.dexp_left_se3(x), lie.adjoint(T) * lie.dexp_right_se3(x), x)
        omega = x[3:, :]
        assert_close(lie.dexp_left_so3(omega), lie.rotation(T) * lie.dexp_right_so3(omega), omega)
        checked += 1
    assert checked == 13 + 4


def test_dexp_is_the_differential_of_exp() -> None:
    """Central differences of the 40-digit matrix exponential, with step 1e-15 and error 1e-30."""
    checked = 0
    with mpmath.workdps(DIGITS + 20):
        step = mpmath.mpf("1e-15")
        for x, y in zip(
            few_twists([1e-8, 0.3, 2.0, 3.141]), random_twists(4, seed=12), strict=True
        ):
            X, Y = wide(lie.hat_se3(x)), wide(lie.hat_se3(y))
            ahead, back = (mpmath.expm(X + s * Y, method="taylor") for s in (step, -step))
            slope, inverse = (ahead - back) / (2 * step), mpmath.expm(-X, method="taylor")
            assert_close(lie.hat_se3(lie.dexp_left_se3(x) * y), slope * inverse, x)
            assert_close(lie.hat_se3(lie.dexp_right_se3(x) * y), inverse * slope, x)
            checked += 1
    assert checked == 4


def test_dexp_at_zero_is_exact() -> None:
    v = lie.Matrix([1, sqrt(2), -3])
    x = lie.Matrix.vstack(v, zeros(3, 1))
    P = lie.hat_so3(v)
    assert lie.dexp_left_so3(zeros(3, 1)) == eye(3)
    assert lie.dexp_left_se3(x) == lie.Matrix([[eye(3), P / 2], [zeros(3, 3), eye(3)]])
    assert lie.dexp_right_inverse_se3(x) == lie.Matrix([[eye(3), P / 2], [zeros(3, 3), eye(3)]])


def test_dexp_at_a_right_angle_is_exact() -> None:
    x = lie.Matrix([0, 0, pi / 2])
    assert lie.dexp_left_so3(x) == lie.Matrix([[2, -2, 0], [2, 2, 0], [0, 0, pi]]) / pi
    inverse = lie.Matrix([[pi / 4, pi / 4, 0], [-pi / 4, pi / 4, 0], [0, 0, 1]])
    assert (lie.dexp_left_inverse_so3(x) - inverse).expand() == zeros(3, 3)


@pytest.mark.parametrize("turns", [1, 2, -1])
def test_dexp_inverse_at_full_revolutions_is_rejected(turns: int) -> None:
    omega = lie.Matrix([0, 1, 1]) * sqrt(2) * pi * turns
    with pytest.raises(ValueError, match=r"no inverse at \|omega\| = .*pi: expected"):
        lie.dexp_left_inverse_so3(omega)
    with pytest.raises(ValueError, match="no inverse"):
        lie.dexp_right_inverse_se3(lie.Matrix.vstack(zeros(3, 1), omega))
    assert lie.dexp_left_so3(omega) * omega == omega


COEFFICIENTS = {
    "SINC": lambda t: mpmath.sin(t) / t,
    "VERSINE": lambda t: (1 - mpmath.cos(t)) / t**2,
    "HALF_ANGLE_VERSINE": lambda t: (1 - mpmath.cos(t)) / t**2,
    "SINE_DEFECT": lambda t: (t - mpmath.sin(t)) / t**3,
    "COTANGENT": lambda t: 1 / t**2 - mpmath.cot(t / 2) / (2 * t),
    "VERSINE_RATE": lambda t: (t * mpmath.sin(t) + 2 * mpmath.cos(t) - 2) / t**4,
    "SINE_DEFECT_RATE": lambda t: (3 * mpmath.sin(t) - 2 * t - t * mpmath.cos(t)) / t**5,
    "COTANGENT_RATE": lambda t: (
        -2 / t**4 + mpmath.cot(t / 2) / (2 * t**3) + 1 / (2 * mpmath.sin(t / 2) * t) ** 2
    ),
}


@pytest.mark.parametrize("name", COEFFICIENTS)
def test_coefficients_are_accurate_to_their_digits(name: str) -> None:
    coefficient = getattr(lie, name)
    checked = 0
    for digits in (15, 30, 50):
        for angle in ("1e-40", "1e-8", "1e-3", "0.5", "0.99999", "1.00001", "3.14159", "5"):
            theta = Float(angle, digits)
            with mpmath.workdps(300):
                expected = COEFFICIENTS[name](theta._to_mpmath(1000))
                value = coefficient(theta)._to_mpmath(1000)
                assert abs(value / expected - 1) < mpmath.mpf(10) ** (3 - digits)
            checked += 1
    assert checked == 24


@pytest.mark.parametrize("name", COEFFICIENTS)
def test_coefficients_at_zero_are_their_limits(name: str) -> None:
    with mpmath.workdps(300):
        limit = COEFFICIENTS[name](mpmath.mpf("1e-30"))
    value = getattr(lie, name)(Rational(0))
    assert value.is_Rational
    assert_close(vector(float(limit)), lie.Matrix([value]))
