"""Time scalings agree with their limits, numerical derivatives and known peaks."""

import numpy as np
import pytest

from chasles.errors import InputValueError
from chasles.study.motion import time_scaling

PROFILES = ("cubic", "quintic", "trapezoidal", "s_curve")


def drawn(count):
    rng = np.random.default_rng(1)
    for k in range(count):
        length, speed, acceleration, jerk = 10 ** rng.uniform(-3, 2, 4)
        yield PROFILES[k % 4], length, {"speed": speed, "acceleration": acceleration, "jerk": jerk}


def test_time_scalings_respect_limits_and_end_at_rest():
    checked = 0
    for profile, length, limits in drawn(400):
        found = time_scaling(profile, length, **limits)
        s, v, a = found.at(np.linspace(0, found.duration, 2001))
        np.testing.assert_allclose([s[0], s[-1]], [0, length], atol=1e-9 * length)
        assert np.abs(v).max() <= limits["speed"] * (1 + 1e-9)
        assert np.abs(a).max() <= limits["acceleration"] * (1 + 1e-9)
        assert np.abs(v[[0, -1]]).max() <= 1e-6 * np.abs(v).max()
        assert (np.diff(s) >= -1e-9 * length).all()
        # A time-optimal motion reaches at least one limit.
        jerk = found.coefficients[:, 3] * 6 if found.coefficients.shape[1] > 3 else np.zeros(1)
        peaks = [v.max() / limits["speed"], np.abs(a).max() / limits["acceleration"]]
        assert max(*peaks, np.abs(jerk).max() / limits["jerk"]) > 0.99
        checked += 1
    assert checked == 400


def test_time_scaling_derivatives_match_differences():
    for profile, length, limits in drawn(40):
        found = time_scaling(profile, length, **limits)
        t, h = np.linspace(0, found.duration, 40001, retstep=True)
        s, v, a = found.at(t)
        assert np.abs(np.gradient(s, h) - v)[1:-1].max() <= h * np.abs(a).max() + 1e-9 * length / h
        smooth = np.abs(np.diff(a, prepend=a[0])) < 0.01 * np.abs(a).max()
        slope = np.gradient(v, h)
        kept = smooth & np.roll(smooth, 1) & np.roll(smooth, -1)
        kept[[0, -1]] = False
        np.testing.assert_allclose(slope[kept], a[kept], atol=1e-2 * np.abs(a).max())


def test_polynomial_time_scalings_have_known_peaks():
    cubic, quintic = time_scaling("cubic", 1, duration=1), time_scaling("quintic", 1, duration=1)
    assert cubic.at(0.5)[1] == pytest.approx(1.5)
    assert quintic.at(0.5)[1] == pytest.approx(1.875)
    t = np.linspace(0, 1, 10001)
    assert np.abs(quintic.at(t)[2]).max() == pytest.approx(10 / np.sqrt(3), rel=1e-6)


@pytest.mark.parametrize(
    ("profile", "first"),
    [
        ("constant", "rate"),
        ("cubic", "acceleration"),
        ("quintic", "jerk"),
        ("trapezoidal", "acceleration"),
        ("s_curve", "jerk"),
    ],
)
def test_time_scaling_jumps_only_in_expected_derivative(profile, first):
    found = time_scaling(profile, 0.5, duration=2)
    assert {name for name, _, _ in found.jumps()} == {first}
    assert found.duration == pytest.approx(2)


def test_time_scaling_durations_match_formulas():
    found = time_scaling("trapezoidal", 2, speed=1, acceleration=2)
    assert found.duration == pytest.approx(2.5)
    slower = time_scaling("trapezoidal", 2, speed=1, acceleration=2, duration=5)
    assert slower.at(np.linspace(0, 5, 501))[1].max() == pytest.approx(0.5)
    assert time_scaling(
        "s_curve", 0.5, speed=0.3, acceleration=1, jerk=8
    ).duration == pytest.approx(0.5 / 0.3 + 0.3 / 1 + 1 / 8)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("linear", 1), "expected one of constant, cubic, quintic, trapezoidal, s_curve"),
        (("cubic", 1), "a duration, or a limit of speed or acceleration, for profile cubic"),
        (("s_curve", 1), "a duration, or the limits speed, acceleration, jerk for profile s_curve"),
        (("quintic", -1), "expected a finite length >= 0"),
    ],
    ids=["unknown profile", "cubic without duration", "s_curve without limits", "negative length"],
)
def test_invalid_time_scaling_arguments_are_rejected(arguments, message):
    with pytest.raises(InputValueError, match=message):
        time_scaling(*arguments)


@pytest.mark.parametrize(
    ("profile", "limit"),
    [
        ("trapezoidal", {"speed": 0.4}),
        ("trapezoidal", {"acceleration": 0.4}),
        ("s_curve", {"jerk": 1.0}),
        ("s_curve", {"speed": 0.4, "acceleration": 9.0}),
    ],
)
def test_duration_beyond_a_single_limit_is_rejected(profile, limit):
    with pytest.raises(InputValueError, match=r"a duration of 3 s requires .* above the limit"):
        time_scaling(profile, 1, duration=3, **limit)
    scaling = time_scaling(profile, 1, duration=9, **limit)
    assert scaling.duration == pytest.approx(9)


def test_too_short_duration_is_rejected():
    for profile in PROFILES:
        with pytest.raises(InputValueError, match=r"a duration of at least .* s, got 1 s"):
            time_scaling(profile, 1, duration=1, speed=0.5, acceleration=1, jerk=1)
