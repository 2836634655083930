"""Tests the removal of rounding noise from the numbers in robot files."""

import math
import random
from fractions import Fraction

import pytest
import sympy as sp

from chasles.derive.description.noise import (
    exact_angle,
    exact_direction,
    exact_directions,
    without_noise,
)
from chasles.derive.model.cleaning import decimal_places, written
from chasles.derive.model.placements import align_z
from chasles.derive.model.tolerances import CHANCE, NOISE

R = sp.Rational
C15, S15 = sp.cos(sp.pi / 12), sp.sin(sp.pi / 12)
AT_A_METER = Fraction(1, 10**9)


@pytest.mark.parametrize(
    ("found", "taken"),
    [
        ("0.20249999999999999", "0.2025"),
        ("-0.09999999999999998", "-0.1"),
        ("0.30000000000000004", "0.3"),
        ("6.123233995736766e-17", "0"),
        ("-1e-9", "0"),
        ("0.2025000007348123", "0.2025"),
        ("123.00000000001", "123"),
        ("0.20000000298023224", "0.2"),
        ("0.3332999944686890", "0.3333"),
        ("0.20010000610351562", "0.2001"),
        # Noise removal does not change short numbers, calibrated values or small lengths.
        ("0.0009765625", "0.0009765625"),
        ("123456.7890625", "123456.7890625"),
        ("0.0001", "0.0001"),
        ("1.1e-8", "1.1e-8"),
        ("0.2025001", "0.2025001"),
        ("0.128379960509584", "0.128379960509584"),
        ("0.000156", "0.000156"),
        ("1/3", "1/3"),
    ],
)
def test_length_noise_is_removed_and_intended_digits_stay(found, taken):
    assert without_noise(R(found), AT_A_METER) == R(taken)


def test_noise_threshold_scales_with_longest_length():
    assert without_noise(R("4.2e-7"), Fraction(1, 10**6)) == 0
    assert without_noise(R("4.2e-10"), Fraction(1, 10**12)) == R("4.2e-10")


def test_short_decimals_are_recovered_from_noise():
    dice = random.Random(1)
    for _ in range(150):
        length = R(dice.randint(-(10**5), 10**5), 10**5)
        noisy = R(repr(float(length) + 10 ** dice.uniform(-16, -9.1) * dice.choice((-1, 1))))
        assert without_noise(noisy, AT_A_METER) == length


def test_long_decimals_are_rarely_changed():
    dice = random.Random(2)
    texts = [f"{dice.uniform(-1, 1):.{dice.randint(6, 17)}f}" for _ in range(300)]
    changed = [text for text in texts if without_noise(R(text), AT_A_METER) != R(text)]
    # Noise removal changes only random numbers that contain three consecutive zeros or nines.
    assert len(changed) < 0.02 * len(texts)
    assert all(abs(without_noise(R(t), AT_A_METER) - R(t)) <= NOISE for t in changed)


@pytest.mark.parametrize(
    ("found", "taken"),
    [
        ("1.5708", sp.pi / 2),
        ("1.5707", sp.pi / 2),
        ("1.571", sp.pi / 2),
        ("1.57", sp.pi / 2),
        ("3.14", sp.pi),
        ("-3.1415", -sp.pi),
        ("3.14159", sp.pi),
        ("6.2832", 2 * sp.pi),
        ("-2.3562", -3 * sp.pi / 4),
        ("0.785398", sp.pi / 4),
        ("0.785", sp.pi / 4),
        ("0.262", sp.pi / 12),
        ("1.5708000000002", sp.pi / 2),
        ("1.5707963267948966", sp.pi / 2),
        ("1.5707963260", sp.pi / 2),
        ("6e-17", sp.S.Zero),
        ("1.5707963705062866", sp.pi / 2),
        ("-3.1415927410125732", -sp.pi),
        ("1.570796325", sp.pi / 2),
        ("0.7853975", sp.pi / 4),
        ("-2.0943933333333335", -2 * sp.pi / 3),
        # Angles with few decimal places, a calibrated angle and small angles stay unchanged.
        ("0.79", R("0.79")),
        ("1.6", R("1.6")),
        ("3", R(3)),
        ("1.570123", R("1.570123")),
        ("1.5706", R("1.5706")),
        ("1.57079", sp.pi / 2),
        ("1.57078", R("1.57078")),
        ("1.570796323", R("1.570796323")),
        ("1.0467", R("1.0467")),
        ("0.001", R("0.001")),
        ("0.0000073464", R("0.0000073464")),
    ],
    ids=str,
)
def test_rounded_angles_snap_to_fractions_of_pi(found, taken):
    assert exact_angle(R(found)) == taken


def test_exact_angles_are_unchanged():
    atan, degree = sp.atan(R(3, 4)), sp.pi / 180
    for angle in (sp.pi / 2, 33 * degree, sp.pi / 7, atan, sp.pi / 2 + R(1, 100), sp.S.Zero):
        assert exact_angle(angle) == angle
    assert exact_angle(R("89.99999999999999") * degree) == sp.pi / 2
    assert exact_angle(R("89.9999") * degree) == R("89.9999") * degree


def test_multiples_of_fifteen_degrees_are_recovered_from_digits():
    checked = 0
    for twelfths in (*range(-30, 0, 7), *range(31)):
        angle = sp.pi * twelfths / 12
        for places in range(3, 17):
            shown = f"{float(angle):.{places}f}"
            cut = f"{float(angle):.25f}"[: len(shown)]
            for text in (shown, cut):
                if places > 3 or not text.endswith("0"):
                    assert exact_angle(R(text)) == angle, text
                    checked += 1
    assert checked > 36 * 14 * 2 - 20


def test_fractions_of_rounded_pi_become_fractions_of_pi():
    dice = random.Random(5)
    for _ in range(100):
        digits = dice.randint(4, 12)
        pi = R("3.141592653589793"[: digits + 2])
        pi = dice.choice((pi, R(f"{math.pi:.{digits}f}")))
        part = dice.choice((-1, 1)) * R(dice.randint(1, 24), 12)
        product = float(part * pi)
        for text in (repr(product), f"{product:.{digits}f}", f"{product:.{digits + 2}f}"):
            assert exact_angle(R(text)) == part * sp.pi, text


@pytest.mark.parametrize("places", [2, 3, 4, 6, 9])
def test_random_angles_are_rarely_snapped(places):
    dice = random.Random(places)
    angles = [R(f"{dice.uniform(-6, 6):.{places}f}") for _ in range(250)]
    taken = [angle for angle in angles if exact_angle(angle) != angle]
    # Few random angles are rounded or truncated values of exact fractions of pi by chance.
    assert len(taken) <= 2 * CHANCE * len(angles)
    assert places < 6 or not taken


def vector(text):
    x, y, z = map(R, text.split())
    return x, y, z


@pytest.mark.parametrize(
    ("found", "taken"),
    [
        ("0 6e-17 1", (0, 0, 1)),
        ("-1 1.2e-16 -6e-33", (-1, 0, 0)),
        ("0 0.9999999999999998 0", (0, 1, 0)),
        ("0.866 0 0.5", (sp.sqrt(3) / 2, 0, R(1, 2))),
        ("0.707 0.5 0.5", (sp.sqrt(2) / 2, R(1, 2), R(1, 2))),
        ("0.5 0.5 0.7071067690849304", (R(1, 2), R(1, 2), sp.sqrt(2) / 2)),
        ("0.9659258127212524 0 0.258819043636322", (C15, 0, S15)),
        # The direction of a rounded vector becomes exact.
        ("0.7071068 0.7071068 0", vector("0.7071068 0.7071068 0")),
        ("1 2 3", (1, 2, 3)),
        ("0.6 0 0.8", (R(3, 5), 0, R(4, 5))),
        ("0.0001 0 1", (R(1, 10000), 0, 1)),
        ("0.87 0.5 0", (R("0.87"), R("0.5"), 0)),
        ("0 0 0", (0, 0, 0)),
    ],
    ids=lambda value: value if isinstance(value, str) else str(tuple(value)),
)
def test_rounded_directions_snap_to_exact_unit_vectors(found, taken):
    assert exact_direction(vector(found)) == taken


@pytest.mark.parametrize(("digits", "first"), [(4, 0), (7, 1), (16, 2)])
def test_exact_directions_are_recovered_from_digits(digits, first):
    checked = 0
    for named, numbers in exact_directions()[first::12]:
        direction = named.exact
        assert max(abs(float(a) - b) for a, b in zip(direction, numbers, strict=True)) < 3e-16
        texts = [f"{number:.{digits}f}" for number in numbers]
        found = exact_direction(tuple(map(R, texts)))
        off = [float(a) - b for a, b in zip(found, numbers, strict=True)]
        proportional = len({abs(c) for c in direction if c != 0}) == 1
        assert found == direction or (proportional and max(map(abs, off)) < 10.0**-digits), texts
        checked += 1
    assert checked > 50


def test_random_directions_stay_and_scaled_copies_align_equally():
    dice = random.Random(3)
    stayed = 0
    for _ in range(25):
        given = tuple(R(f"{dice.gauss(0, 1):.17f}") for _ in range(3))
        found = exact_direction(given)
        stayed += found == given
        assert max(abs(a - b) for a, b in zip(found, given, strict=True)) <= 3 * NOISE
        before, twice = align_z(given), align_z(tuple(2 * component for component in given))
        assert before == twice
        # The angles that rotate z onto an axis are finite decimals, not arc functions of long
        # fractions.
        assert all(decimal_places(motion.angle) is not None for motion in before)
    assert stayed > 22


def test_align_z_reproduces_axes_to_24_digits():
    dice = random.Random(4)
    axes = [tuple(R(f"{dice.gauss(0, 1):.9f}") for _ in range(3)) for _ in range(4)]
    axes += [direction.exact for direction, _ in exact_directions()[::97]] + [(R(1), R(2), R(3))]
    for axis in axes:
        azimuth, tilt = 0, 0
        for motion in align_z(axis):
            azimuth, tilt = (motion.angle, tilt) if motion.axis == "z" else (azimuth, motion.angle)
        turned = (sp.sin(azimuth) * sp.sin(tilt), -sp.cos(azimuth) * sp.sin(tilt), sp.cos(tilt))
        length = sp.sqrt(sum(component**2 for component in axis).evalf(40))
        for a, b in zip(turned, axis, strict=True):
            assert abs(sp.N(a, 40) - sp.N(b, 40) / length) < 1e-24


def test_numbers_are_printed_as_written_in_files():
    for text in ("0.2025", "-1.5708", "0.20249999999999999", "6.123e-17", "-2e-9", "12", "1e-7"):
        assert written(R(text)) == text
    assert written(sp.pi * R("89.5") / 180) == "89.5 deg"
    assert written(sp.sqrt(2)) == "sqrt(2)"
    assert math.isclose(float(R(written(R("0.0000001234")))), 1.234e-7)
