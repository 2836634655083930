"""Numbers that files round or blur, taken for the exact numbers behind them.

Three things are told apart by the digits that are written. *Noise* is a short decimal with foreign
digits far behind it: 0.20249999999999999, or 6.1e-17 beside lengths of a metre. A *rounded angle*
is a multiple of 15 degrees to the places that are written, 1.5708, or the same part of a rounded
pi, 1.570796325 = 3.14159265 / 2. A *rounded direction* is a unit vector whose components are
cosines of such angles, (0.7071068, 0.7071068, 0), or a diagonal of a cube. A number that is exact
already, pi/2 or sqrt(2)/2 or 0.2025, stays.
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
"""Steps of the angles that files round, the finer first."""
_PLACES_OF_PI = 4
"""Least places of a rounded pi that was divided: 3.14 is further off than joints are assembled."""
_LEAST_PLACES = 3
"""Places from which the components of a direction tell a rounded one from a rough one."""
_PI_AS_WRITTEN = (
    _PI,
    *(
        Fraction(to_whole(_PI * 10**places), 10**places)
        for places in range(_PLACES_OF_PI, 16)
        for to_whole in (round, math.floor)
    ),
)
"""Pi, then rounded and cut off to places that increase up to a double's."""
_QUARTER = 6
"""Steps of 15 degrees in a right angle."""
_FIRST_SINES = (
    *(0.0, (math.sqrt(6) - math.sqrt(2)) / 4, 0.5, math.sqrt(0.5)),
    *(math.sqrt(3) / 2, (math.sqrt(6) + math.sqrt(2)) / 4),
)
_FALLING = (1.0, *_FIRST_SINES[:0:-1])
_HALF = (*_FIRST_SINES, *_FALLING)
_SINES = (*_HALF, *(-sine if sine else 0.0 for sine in _HALF), *_HALF)
"""Sines of multiples of 15 degrees, from 0 on, with exact zeros."""
_THIRD = math.sqrt(3) / 3
_FEWEST_DIGITS = 13
"""Digits above which a number may be one of single precision: exact binary fractions have fewer."""
_SINGLE_PLACES = 7
"""Places that single precision has of a component of a unit vector."""


def without_noise(value: sp.Expr, tolerance: Fraction) -> sp.Expr:
    """The short decimal that a decimal differs from by noise, else the decimal itself.

    A number of single precision that is written with the digits of a double, 0.20000000298023224,
    is its shortest decimal in that precision first. A decimal d of k places is meant if the
    difference is at most ``tolerance`` and ``NOISE_GAP`` times smaller than the last place of d:
    three zeros or nines follow it.

    Args:
        value: A number; one that is no finite decimal is returned as it is.
        tolerance: Greatest difference that is noise, in the unit of the value.
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
    """The shortest decimal of a number of single precision in metres or millimetres, if it is one.

    Any other number is returned as it is, also one that is written with few digits.
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
    """The exact angle (radian) that an angle of a file stands for, else the angle without noise.

    A decimal stands for a multiple of pi/12 if it is that multiple rounded or cut off to its
    places, and has so many places that no more than ``CHANCE`` of all angles are written like
    it: three places, or two for right angles. The pi of the multiple may be rounded or cut off
    before, to as many places or fewer, but at least four: 0.7853975 is 3.14159 / 4. A zero at the
    end is no place, so that 2.880 stays, and zero is written as zero.
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
    """The multiple of pi that a decimal of a file in degrees stands for in radians, if it does.

    It is at most one turn. Right angles are told by two places, 1.57; other multiples of pi/12 by
    four, 0.7854.
    """
    places = decimal_places(value) or 0
    multiple = exact_angle(value) / sp.pi
    if not value or not multiple.is_Rational or abs(multiple) > 2:  # noqa: PLR2004
        return None
    is_right = (2 * multiple).is_Integer
    return multiple * sp.pi if is_right or places >= _PLACES_OF_PI else None


def _is_rounded(angle: sp.Expr, part: Fraction, step: Fraction) -> bool:
    """Whether the magnitude of a decimal is a part of pi, rounded or cut off, as pi may be."""
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
    """The exact direction that a direction of a file stands for, else the vector without noise.

    A vector of decimals of any length stands for a unit vector of :func:`exact_directions`,
    scaled to its length, if each component agrees to one unit of the last place that is written or
    to ``NOISE`` of the length, and is zero where the unit vector has zeros.

    Returns:
        A unit vector of roots, or decimals in the proportions of the file.
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
    unit = 10.0**-places if places >= _LEAST_PLACES else 0.0
    for direction, components in exact_directions():
        pairs = list(zip(numbers, components, strict=True))
        off = max(abs(number - length * component) for number, component in pairs)
        same_zeros = all((number == 0) == (component == 0) for number, component in pairs)
        if same_zeros and off <= max(unit, NOISE * length):
            return direction.exact
    return x, y, z


@dataclass(frozen=True)
class _Turned:
    """A direction turned from an axis, and then about another, by multiples of 15 degrees."""

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
    """A diagonal of a cube."""

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
    """Unit vectors that files round, with their numbers; each is made exact when it is found."""
    found: dict[tuple[float, ...], tuple[_Turned | _Diagonal, tuple[float, float, float]]] = {}
    directions: list[_Turned | _Diagonal] = []
    directions += [_Turned(*at) for at in product(range(24), range(13), range(3))]
    directions += [_Diagonal(signs) for signs in product((1, -1), repeat=3)]
    for direction in directions:
        numbers = direction.numbers
        found.setdefault(tuple(round(number, 12) for number in numbers), (direction, numbers))
    return tuple(found.values())


def _shifted(vector: tuple[Number, Number, Number], by: int) -> tuple[Number, Number, Number]:
    """The components, moved on cyclically."""
    x, y, z = (vector[(k - by) % 3] for k in range(3))
    return x, y, z
