"""exp and log are inverses of each other, also at the identity, small angles and half turns."""

import math

import mpmath
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sympy import Float, Rational, cos, eye, pi, sin, sqrt, zeros

from . import lie
from .oracles import (
    ANGLES,
    AXES,
    LAW_TOLERANCE,
    NEAR_HALF_TURN,
    PRINCIPAL_ANGLES,
    assert_close,
    dexp_series,
    distance,
    expm,
    few_twists,
    random_twists,
    rotation_vectors,
    vector,
    wide,
)


def test_exp_so3_is_the_matrix_exponential() -> None:
    checked = 0
    for omega in rotation_vectors(ANGLES):
        assert_close(lie.exp_so3(omega), expm(lie.hat_so3(omega)), omega)
        checked += 1
    assert checked == 13 * 4


def test_exp_se3_is_the_matrix_exponential() -> None:
    checked = 0
    for x in [*few_twists(ANGLES), *random_twists(6, seed=6)]:
        assert_close(lie.exp_se3(x), expm(lie.hat_se3(x)), x)
        checked += 1
    assert checked == 13 + 6


def test_exp_and_log_se3_keep_thirty_digits() -> None:
    checked = 0
    for x in [*few_twists([1e-8, 0.3, 1 - 1e-9, 1 + 1e-9, 3.0]), *random_twists(3, seed=7)]:
        x30 = x.applyfunc(lambda e: Float(e, 30))
        assert distance(lie.exp_se3(x30), expm(lie.hat_se3(x))) < mpmath.mpf("1e-28")
        assert distance(lie.log_se3(lie.exp_se3(x30)), wide(x)) < mpmath.mpf("1e-27")
        checked += 1
    assert checked == 5 + 3


def test_log_undoes_exp() -> None:
    checked = 0
    for x in few_twists(PRINCIPAL_ANGLES):
        omega = x[3:, :]
        assert_close(lie.log_so3(lie.exp_so3(omega)), omega, omega)
        checked += 1
    for x in [*few_twists(PRINCIPAL_ANGLES), *random_twists(6, seed=8)]:
        assert_close(lie.log_se3(lie.exp_se3(x)), x, x)
        checked += 1
    assert checked == 2 * 12 + 6


def test_exp_undoes_log() -> None:
    checked = 0
    for x in few_twists([*ANGLES, *NEAR_HALF_TURN]):
        T = lie.exp_se3(x)
        assert_close(lie.exp_se3(lie.log_se3(T)), T, x)
        assert_close(lie.exp_so3(lie.log_so3(lie.rotation(T))), lie.rotation(T), x)
        checked += 1
    assert checked == 17


def test_log_has_small_relative_error_at_small_angles() -> None:
    """Test the relative error of log_so3 at rotation angles of 1e-8 and 1e-6."""
    checked = 0
    for omega in rotation_vectors([1e-8, 1e-6]):
        difference = distance(lie.log_so3(lie.exp_so3(omega)), omega)
        assert difference <= LAW_TOLERANCE * wide(omega.norm() * eye(1))[0]
        checked += 1
    assert checked == 8


def test_log_at_half_revolution_in_floats_has_a_defined_sign() -> None:
    """A rotation by pi has the axes a and -a.

    Rounding errors must not change the sign of the axis.
    """
    checked = 0
    for axis in AXES:
        first = next(a for a in axis if a)
        expected = vector(*(math.copysign(math.pi, first) * a for a in axis))
        for sign in (1, -1):
            R = lie.exp_so3(vector(*(sign * math.pi * a for a in axis)))
            assert_close(lie.log_so3(R), expected, axis)
            for k in range(3):
                noise = lie.hat_so3(vector(*(2e-16 if j == k else 0.0 for j in range(3))))
                assert_close(lie.log_so3(R + sign * noise), expected, axis)
                checked += 1
    assert checked == 4 * 2 * 3


@pytest.mark.parametrize(
    "axis",
    [
        lie.Matrix([0, 0, 1]),
        lie.Matrix([1, 0, 0]),
        lie.Matrix([1, -1, 0]) / sqrt(2),
        lie.Matrix([0, 1, 1]) / sqrt(2),
        lie.Matrix([1, 1, -1]) / sqrt(3),
        lie.Matrix([2, -3, 6]) / 7,
    ],
    ids=["z", "x", "x-y", "y+z", "x+y-z", "2x-3y+6z"],
)
def test_log_at_exact_half_revolution_is_exact(axis: lie.Matrix) -> None:
    R = lie.exp_so3(pi * axis)
    assert (2 * axis * axis.T - eye(3)).expand() == R
    assert lie.log_so3(R) == pi * axis
    assert lie.log_so3(lie.exp_so3(-pi * axis)) == pi * axis


def test_exact_angles_stay_exact() -> None:
    checked = 0
    for axis in (lie.Matrix([0, 0, 1]), lie.Matrix([1, 1, 0]) / sqrt(2), lie.Matrix([2, 3, 6]) / 7):
        for angle in (pi / 6, pi / 4, pi / 3, pi / 2, 2 * pi / 3, 3 * pi / 4, 5 * pi / 6, pi):
            R = lie.exp_so3(angle * axis)
            assert not R.atoms(Float)
            assert (R.T * R).expand() == eye(3)
            assert (lie.log_so3(R) - angle * axis).expand() == zeros(3, 1)
            checked += 1
    assert checked == 24


def test_exp_and_log_of_identity_are_exact() -> None:
    assert lie.exp_so3(zeros(3, 1)) == eye(3)
    assert lie.log_so3(eye(3)) == zeros(3, 1)
    v = lie.Matrix([Rational(1, 3), -2, sqrt(5), 0, 0, 0])
    assert lie.exp_se3(v) == lie.pose(eye(3), v[:3, :])
    assert lie.log_se3(lie.exp_se3(v)) == v


def test_hidden_zero_angle_takes_the_limit() -> None:
    nothing = sin(1) ** 2 + cos(1) ** 2 - 1
    assert nothing.is_zero is None
    omega = lie.Matrix([nothing, 0, 0])
    for function in (lie.exp_so3, lie.dexp_left_so3, lie.dexp_left_inverse_so3):
        assert all(e.equals(0) for e in function(omega) - eye(3))
    assert lie.SINC(nothing) == 1
    assert lie.COTANGENT(nothing) == Rational(1, 12)
    R = lie.Matrix([[1, -nothing, 0], [nothing, 1, 0], [0, 0, 1]])
    assert lie.log_so3(R) == zeros(3, 1)
    tiny = Rational(1, 10**8)
    assert lie.exp_so3(lie.Matrix([tiny, 0, 0]))[2, 1] != 0


def test_a_single_float_makes_every_entry_a_float() -> None:
    """For an angle that is a sum of exact and Float terms, the power series is used, too."""
    mixed = lie.Matrix([Float(0.1), sqrt(2), pi, Float(1e-8), sqrt(2) / 10**8, pi / 10**8])
    for function in (lie.exp_se3, lie.dexp_left_se3, lie.dexp_left_inverse_se3):
        assert all(e.is_Float or e in (0, 1) for e in function(mixed))
        assert_close(function(mixed), function(mixed.n()))
    assert_close(lie.dexp_left_se3(mixed), dexp_series(lie.ad(mixed.n())))


def test_an_undecidable_number_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    hidden = sin(1) ** 2 + cos(1) ** 2 - 1
    monkeypatch.setattr(type(hidden), "equals", lambda *_: None)
    with pytest.raises(ValueError, match=r"cannot decide whether .* is zero: expected a simpler"):
        lie.SINC(hidden)


def test_inverse_pose_has_the_negative_logarithm() -> None:
    checked = 0
    for x in random_twists(10, seed=9):
        assert_close(lie.log_se3(lie.inverse_se3(lie.exp_se3(x))), -x, x)
        checked += 1
    assert checked == 10


component = st.floats(-1.8, 1.8, allow_subnormal=False)


@settings(max_examples=8, derandomize=True, database=None)
@given(st.lists(component, min_size=6, max_size=6))
def test_exp_and_log_match_expm_at_hypothesis_twists(entries: list[float]) -> None:
    """The length of the rotation vector is at most 1.8 sqrt(3) < pi."""
    x = vector(*entries)
    T = lie.exp_se3(x)
    assert_close(T, expm(lie.hat_se3(x)), x)
    assert_close(lie.log_se3(T), x, x)
