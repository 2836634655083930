"""Recognizes exact values behind rounded or noisy numbers.

chasles distinguishes noisy numbers, rounded angles and rounded directions. A *noisy* number is a
short decimal with stray distant digits, such as 0.20249999999999999, or 6.1e-17 next to lengths of
a meter. A *rounded angle* is a multiple of 15 degrees that is rounded to the written decimal
places, such as 1.5708. For example, 1.570796325 is half of the rounded pi 3.14159265. A *rounded
direction* is a unit vector, such as (0.7071068, 0.7071068, 0). The exact components are cosines of
multiples of 15 degrees, or the direction is a diagonal of a cube. Exact numbers such as pi/2,
sqrt(2)/2 or 0.2025 do not change.
"""

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from itertools import product
from typing import TypeVar

import numpy as np
import sympy as sp

from ..model.cleaning import decimal_places
from ..model.exact import snap_angle
from ..model.placements import Vector
from ..model.tolerances import CHANCE, DOUBLE, EVALUATION_DIGITS, NOISE, NOISE_GAP, SINGLE

Number = TypeVar("Number", float, sp.Expr)

_PI = Fraction(str(sp.N(sp.pi, EVALUATION_DIGITS)))
_STEPS = (sp.pi / 12, sp.pi / 2)
"""A rounded angle is replaced by a multiple of one of these angles: pi/12 or pi/2. Multiples of
pi/12 are tested first."""
_PLACES_OF_PI = 4
"""Minimum number of decimal places of a rounded pi. 3.14 is too inaccurate for a real joint."""
_MIN_PLACES = 3
"""Minimum number of decimal places of a rounded direction. A direction with fewer than three
decimal places is only approximate and is not changed."""
_PI_AS_WRITTEN = (
    _PI,
    *(
        Fraction(to_whole(_PI * 10**places), 10**places)
        for places in range(_PLACES_OF_PI, 16)
        for to_whole in (round, math.floor)
    ),
)
"""The exact value of pi, then pi rounded and truncated to increasing numbers of places."""
_QUARTER = 6
"""Number of 15-degree steps in a right angle."""
_FIRST_SINES = (
    *(0.0, (math.sqrt(6) - math.sqrt(2)) / 4, 0.5, math.sqrt(0.5)),
    *(math.sqrt(3) / 2, (math.sqrt(6) + math.sqrt(2)) / 4),
)
_FALLING = (1.0, *_FIRST_SINES[:0:-1])
_HALF = (*_FIRST_SINES, *_FALLING)
_SINES = (*_HALF, *(-sine if sine else 0.0 for sine in _HALF), *_HALF)
"""Sines of 0, 15, 30, ... degrees. Zeros are exact."""
_THIRD = math.sqrt(3) / 3
_FEWEST_DIGITS = 13
"""A decimal with fewer digits, such as 0.375, is not tested as a single-precision number.
"""
_SINGLE_PLACES = 7
"""Number of decimal places of a unit-vector component in single precision."""


def without_noise(value: sp.Expr, tolerance: Fraction) -> sp.Expr:
    """Remove the noise of a decimal.

    A decimal without noise is returned unchanged.

    A single-precision number with the digits of a double, such as 0.20000000298023224, is first
    shortened. The result is the shortest decimal that differs from the value by at most
    ``tolerance``. One unit in the last place of the result must be at least ``NOISE_GAP`` times the
    difference between the result and the value.

    Args:
        value: A number. A number that is not a finite decimal is returned unchanged.
        tolerance: Maximum noise, in the unit of the value.
    """
    places = decimal_places(value)
    if not places:
        return value
    number = single_precision(Fraction(value.p, value.q))
    for k in range(places):
        short = Fraction(round(number * 10**k), 10**k)
        if abs(number - short) <= min(tolerance, Fraction(1, NOISE_GAP * 10**k)):
            return sp.Rational(short.numerator, short.denominator)
    return sp.Rational(number.numerator, number.denominator)


def single_precision(number: Fraction) -> Fraction:
    """Return the shortest decimal for a single-precision number in meters or millimeters.

    Numbers that are not in single precision, and numbers with few digits, are not changed.
    """
    places = decimal_places(sp.Rational(number.numerator, number.denominator)) or 0
    if abs(number) * 10**places < 10**_FEWEST_DIGITS:
        return number
    for unit in (1, 1000):
        single = np.float32(float(number * unit))
        if abs(number * unit - Fraction(float(single))) <= Fraction(DOUBLE) * abs(number * unit):
            return Fraction(str(single)) / unit
    return number


def exact_angle(value: sp.Expr) -> sp.Expr:
    """Return the exact value (radian) of a rounded angle.

    Noise is removed from an angle that is not a rounded multiple of pi/12.

    A decimal becomes a multiple of pi/12 if rounding or truncating this multiple gives the decimal.
    The decimal must have so many places that an arbitrary angle matches a multiple of pi/12 with a
    probability of at most ``CHANCE``. Three decimal places are enough. For right angles, two
    decimal places are enough. The multiple may also use a rounded value of pi. This value of pi has
    at least four decimal places, and at most as many as the decimal in the file. Trailing zeros do
    not count as places, so the decimal 2.880 stays as it is. An angle of zero must be written as 0.
    """
    degrees = value * 180 / sp.pi
    if degrees.is_Rational:
        in_degrees = Fraction(NOISE) * 180 / _PI
        return without_noise(degrees, in_degrees) * sp.pi / 180
    if decimal_places(value) is None:
        return value
    multiple = snap_angle(value)
    if multiple != value:
        return multiple
    angle = without_noise(value, Fraction(NOISE))
    number = Fraction(value.p, value.q)
    is_single = single_precision(number) != number
    for step in _STEPS:
        size = Fraction(step / sp.pi) * _PI
        count = round(number / size)
        if is_single and abs(number - count * size) <= Fraction(SINGLE) * abs(number):
            return count * step
        if count and _is_rounded(angle, abs(count) * Fraction(step / sp.pi), size):
            return count * step
    return angle


def radians_meant(value: sp.Expr) -> sp.Expr | None:
    """Return the multiple of pi that a number in degrees would match if it were in radians.

    The result is None if no multiple matches.

    The result is also None for an angle of more than one turn. A right angle is recognized from two
    decimal places (1.57). Other multiples of pi/12 are recognized only in numbers with at least
    four decimal places, such as 0.7854.
    """
    places = decimal_places(value) or 0
    multiple = exact_angle(value) / sp.pi
    if not value or not multiple.is_Rational or abs(multiple) > 2:  # noqa: PLR2004
        return None
    is_right = (2 * multiple).is_Integer
    return multiple * sp.pi if is_right or places >= _PLACES_OF_PI else None


def _is_rounded(angle: sp.Expr, part: Fraction, step: Fraction) -> bool:
    """Whether a decimal is a rounded or truncated fraction of pi.

    The value of pi may itself be rounded or truncated.
    """
    number, places = abs(Fraction(angle.p, angle.q)), decimal_places(angle) or 0
    last_place = Fraction(1, 10**places)
    if last_place > Fraction(CHANCE) * step:
        return False
    rounding = Fraction(DOUBLE) * number
    return any(
        -max(last_place / 2, rounding) <= part * pi - number < max(last_place, rounding)
        for pi in _PI_AS_WRITTEN[: 1 + 2 * max(0, places + 1 - _PLACES_OF_PI)]
    )


def exact_direction(vector: Vector) -> Vector:
    """Return the exact unit vector that a rounded direction approximates.

    If the vector is not a rounded direction, only its noise is removed.

    A decimal vector is normalized and compared with the vectors of ``exact_directions``. Each
    component must agree within one unit of the last written place, or within ``NOISE`` times the
    length of the vector. A component that is zero in the exact direction must be exactly zero in
    the file.

    Returns:
        The matching exact direction: a unit vector with exact roots as components. If no exact
        direction matches, the result is the given vector without its noise.
    """
    if any(decimal_places(component) is None for component in vector):
        return vector
    largest = max(abs(Fraction(c.p, c.q)) for c in vector)
    x, y, z = (without_noise(c, Fraction(NOISE) * largest) for c in vector)
    if len({abs(c) for c in (x, y, z) if c != 0}) <= 1:
        return x, y, z
    numbers = (float(x), float(y), float(z))
    places = max(decimal_places(c) or 0 for c in (x, y, z))
    if any(single_precision(Fraction(c.p, c.q)) != Fraction(c.p, c.q) for c in vector):
        places = min(places, _SINGLE_PLACES)
    length = math.hypot(*numbers)
    unit = 10.0**-places if places >= _MIN_PLACES else 0.0
    for direction, components in exact_directions():
        pairs = list(zip(numbers, components, strict=True))
        off = max(abs(number - length * component) for number, component in pairs)
        same_zeros = all((number == 0) == (component == 0) for number, component in pairs)
        if same_zeros and off <= max(unit, NOISE * length):
            return direction.exact
    return x, y, z


@dataclass(frozen=True)
class _Turned:
    """The direction of a frame axis after two rotations by multiples of 15 degrees.

    Both rotations are about frame axes.
    """

    azimuth: int
    tilt: int
    shift: int

    @property
    def numbers(self) -> tuple[float, float, float]:
        level, along = _SINES[self.tilt], _SINES[self.tilt + _QUARTER]
        x, y, z = level * _SINES[self.azimuth + _QUARTER], level * _SINES[self.azimuth], along
        return _shifted((x, y, z), self.shift)

    @property
    def exact(self) -> Vector:
        azimuth, tilt = sp.pi * self.azimuth / 12, sp.pi * self.tilt / 12
        x, y = (sp.expand(sp.sin(tilt) * f(azimuth)) for f in (sp.cos, sp.sin))
        return _shifted((x, y, sp.cos(tilt)), self.shift)


@dataclass(frozen=True)
class _Diagonal:
    """The unit vector along a diagonal of a cube."""

    signs: tuple[int, ...]

    @property
    def numbers(self) -> tuple[float, float, float]:
        x, y, z = (sign * _THIRD for sign in self.signs)
        return x, y, z

    @property
    def exact(self) -> Vector:
        x, y, z = (sign * sp.sqrt(3) / 3 for sign in self.signs)
        return x, y, z


@cache
def exact_directions() -> tuple[tuple[_Turned | _Diagonal, tuple[float, float, float]], ...]:
    """Return the exact unit vectors with their numerical values."""
    found: dict[tuple[float, ...], tuple[_Turned | _Diagonal, tuple[float, float, float]]] = {}
    directions: list[_Turned | _Diagonal] = []
    directions += [_Turned(*at) for at in product(range(24), range(13), range(3))]
    directions += [_Diagonal(signs) for signs in product((1, -1), repeat=3)]
    for direction in directions:
        numbers = direction.numbers
        found.setdefault(tuple(round(number, 12) for number in numbers), (direction, numbers))
    return tuple(found.values())


def _shifted(vector: tuple[Number, Number, Number], by: int) -> tuple[Number, Number, Number]:
    x, y, z = (vector[(k - by) % 3] for k in range(3))
    return x, y, z
