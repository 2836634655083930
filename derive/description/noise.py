"""Numbers that files round or blur, taken for the exact numbers behind them.

Three things are told apart by the digits that are written. *Noise* is a short decimal with foreign
digits far behind it: 0.20249999999999999, or 6.1e-17 beside lengths of a metre. A *rounded angle*
is a multiple of 15 degrees to the places that are written, 1.5708. A *rounded direction* is a unit
vector whose components are cosines of such angles, (0.7071068, 0.7071068, 0), or a diagonal of a
cube. A number that is exact already, pi/2 or sqrt(2)/2 or 0.2025, stays.
"""

import math
from collections.abc import Iterator
from fractions import Fraction
from functools import cache
from itertools import product

import sympy as sp

from ..model.cleaning import decimal_places
from ..model.exact import snap_angle
from ..model.placements import Vector
from ..model.tolerances import CHANCE, EVALUATION_DIGITS, NOISE, NOISE_GAP

_PI = Fraction(str(sp.N(sp.pi, EVALUATION_DIGITS)))
_STEPS = (sp.pi / 12, sp.pi / 2)
"""Steps of the angles that files round, the finer first."""
_LEAST_PLACES = 3
"""Places from which the components of a direction tell a rounded one from a rough one."""


def without_noise(value: sp.Expr, tolerance: Fraction) -> sp.Expr:
    """The short decimal that a decimal differs from by noise, else the decimal itself.

    A decimal d of k places is meant if the difference is at most ``tolerance`` and
    ``NOISE_GAP`` times smaller than the last place of d: three zeros or nines follow it.

    Args:
        value: A number; one that is no finite decimal is returned as it is.
        tolerance: Greatest difference that is noise, in the unit of the value.
    """
    places = decimal_places(value)
    if not places:
        return value
    number = Fraction(value.p, value.q)
    for k in range(places):
        short = Fraction(round(number * 10**k), 10**k)
        if abs(number - short) <= min(tolerance, Fraction(1, NOISE_GAP * 10**k)):
            return sp.Rational(short.numerator, short.denominator)
    return value


def exact_angle(value: sp.Expr) -> sp.Expr:
    """The exact angle (radian) that an angle of a file stands for, else the angle without noise.

    A decimal stands for a multiple of pi/12 if it is that multiple rounded or cut off to its
    places, and has so many places that no more than ``CHANCE`` of all angles are written like
    it: three places, or two for right angles. A zero at the end is no place, so that 2.880 stays,
    and zero is written as zero.
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
    return next((multiple for step in _STEPS for multiple in _rounded(angle, step)), angle)


def _rounded(angle: sp.Expr, step: sp.Expr) -> Iterator[sp.Expr]:
    """The nearest multiple of a step, if a decimal is that multiple rounded or cut off."""
    number = Fraction(angle.p, angle.q)
    size = Fraction(step / sp.pi) * _PI
    count = round(number / size)
    last_place = Fraction(1, 10 ** (decimal_places(angle) or 0))
    missing = abs(count) * size - abs(number)
    if count and -last_place / 2 <= missing < last_place <= Fraction(CHANCE) * size:
        yield count * step


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
    length = math.hypot(*numbers)
    unit = 10.0**-places if places >= _LEAST_PLACES else 0.0
    for direction, components in exact_directions():
        pairs = list(zip(numbers, components, strict=True))
        off = max(abs(number - length * component) for number, component in pairs)
        same_zeros = all((number == 0) == (component == 0) for number, component in pairs)
        if same_zeros and off <= max(unit, NOISE * length):
            return direction
    return x, y, z


@cache
def exact_directions() -> tuple[tuple[Vector, tuple[float, float, float]], ...]:
    """Unit vectors that files round, exact and in floats.

    They are turned from an axis of the frame by multiples of 15 degrees, then about another one by
    such multiples, or point along a diagonal of a cube.
    """
    found: dict[tuple[float, float, float], Vector] = {}
    steps = [sp.pi * k / 12 for k in range(24)]
    for azimuth, tilt in product(steps, steps[:13]):
        level = sp.sin(tilt)
        across, beside = (sp.expand(level * f(azimuth)) for f in (sp.cos, sp.sin))
        along = sp.cos(tilt)
        for turned in ((across, beside, along), (along, across, beside), (beside, along, across)):
            found.setdefault(_floats(turned), turned)
    for signs in product((1, -1), repeat=3):
        diagonal = tuple(sign * sp.sqrt(3) / 3 for sign in signs)
        found.setdefault(_floats(diagonal), diagonal)
    return tuple((direction, numbers) for numbers, direction in found.items())


def _floats(vector: Vector) -> tuple[float, float, float]:
    x, y, z = (float(c) for c in vector)
    return x, y, z
