"""Numbers with units on the command line: "90deg", "250mm"."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from chasles import InputValueError, Robot
from chasles.contract import Coordinate

from .console import warn

FloatArray = NDArray[np.float64]
DECIMALS = 4
"""Number of decimals of printed degrees and millimeters."""
ANGLE, LENGTH = "rad", "m"
_UNITS = {
    "rad": (ANGLE, 1.0),
    "deg": (ANGLE, math.pi / 180),
    "°": (ANGLE, math.pi / 180),
    "m": (LENGTH, 1.0),
    "cm": (LENGTH, 0.01),
    "mm": (LENGTH, 0.001),
}
_DIGITS = "0123456789."
"""Characters that can end a number without a unit."""
_NUMBER = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?)\s*([a-z°]*)", re.IGNORECASE)


def value(text: str, unit: str, name: str) -> float:
    """Return a number in a unit: "rad", "m" or "" for a plain number.

    Raises:
        InputValueError: The text is not a number, or its unit belongs to a different quantity.
    """
    match = _NUMBER.fullmatch(text.strip())
    quantity, factor = _UNITS.get(match[2].lower(), ("", 1.0)) if match else ("", 1.0)
    if match is None or (match[2] and quantity != unit):
        units = ", ".join(short for short, (kind, _) in _UNITS.items() if kind == unit)
        expected = f"a number in {units}" if units else "a number"
        raise InputValueError(f"{name}: expected {expected}, got {text!r}")
    return float(match[1]) * factor


def values(
    text: str,
    units: Sequence[str],
    names: Sequence[str],
    option: str,
    limits: FloatArray | None = None,
) -> FloatArray:
    """Return the numbers of a list separated by commas or spaces.

    A warning suggests degrees for an implausible angle without a unit. An angle is implausible if
    it is more than a full turn outside the limits (n, 2), or more than two turns without limits.

    Raises:
        InputValueError: The list has the wrong length, or one of its words is not a number.
    """
    words = _words(text)
    if len(words) != len(units):
        raise InputValueError(
            f"{option}: expected {len(units)} numbers ({', '.join(names)}), got {len(words)}"
        )
    given = zip(words, units, names, strict=True)
    found = np.array([value(word, unit, f"{option}, {name}") for word, unit, name in given])
    _warn_of_degrees(words, units, found, option, limits)
    return found


def _warn_of_degrees(
    words: Sequence[str],
    units: Sequence[str],
    found: FloatArray,
    option: str,
    limits: FloatArray | None,
) -> None:
    plain = [unit == ANGLE and word[-1] in _DIGITS for word, unit in zip(words, units, strict=True)]
    is_large = np.abs(found) > 2 * math.pi
    if limits is not None:
        lower, upper = limits.T
        # Joints without limits may move by more than a turn.
        is_free = ~np.isfinite(upper - lower) & (np.abs(found) <= 4 * math.pi)
        is_large &= ~(is_free | ((lower <= found) & (found <= upper) & np.isfinite(upper - lower)))
    if (is_large & plain).any():
        pairs = zip(words, plain, strict=True)
        in_degrees = ",".join(f"{word}deg" if is_plain else word for word, is_plain in pairs)
        warn(f"angles without a unit are in radians; for degrees: {option} {in_degrees}")


def _words(text: str) -> list[str]:
    return [word for word in re.split(r"[,\s]+", text.strip()) if word]


def coordinates(robot: Robot, text: str | None, option: str) -> FloatArray:
    """Return the coordinates (n,) from a text, or the reference coordinates for None."""
    if text is None:
        return np.asarray(robot.q_reference, dtype=np.float64)
    units = [one.unit for one in robot.coordinates]
    return values(text, units, robot.coordinate_names, option, np.asarray(robot.limits))


def fixed_values(robot: Robot, words: Iterable[str]) -> dict[str, float]:
    """Return the values of fixed joints and redundancy parameters, keyed by name.

    Raises:
        InputValueError: A word does not have the form NAME=VALUE.
    """
    units = {one.name: one.unit for one in (*robot.coordinates, *robot.chain_joints)}
    found = {}
    for word in words:
        name, separator, text = word.partition("=")
        if not separator:
            raise InputValueError(f"--fixed: expected JOINT=VALUE, got {word!r}")
        found[name.strip()] = value(text, units.get(name.strip(), ANGLE), f"--fixed {name}")
    return found


def positions(joints: Sequence[Coordinate], text: str, option: str) -> dict[str, float]:
    """Return the positions of the joints in a list JOINT=VALUE,..., in the order of the joints.

    Raises:
        InputValueError: A word does not have the form JOINT=VALUE, or a joint is unknown.
    """
    units, found = {joint.name: joint.unit for joint in joints}, {}
    for word in text.split(","):
        name, _, number = (part.strip() for part in word.partition("="))
        if name not in units or not number:
            raise InputValueError(
                f"{option}: expected JOINT=VALUE with a joint of the main chain "
                f"({', '.join(units)}), got {word!r}"
            )
        found[name] = value(number, units[name], f"{option}, {name}")
    return {name: found[name] for name in units if name in found}


def scaled(number: float, unit: str) -> float:
    """Convert an angle to degrees, or a length to millimeters.

    Other numbers do not change.
    """
    return math.degrees(number) if unit == ANGLE else number * 1000 if unit == LENGTH else number


def shown(number: float, unit: str) -> str:
    """Return a number in degrees or millimeters for display."""
    return f"{rounded(scaled(number, unit), DECIMALS):.{DECIMALS}f}"


def rounding(robot: Robot) -> float:
    """Return the largest pose error [m] that the rounding of printed poses causes.

    Rotation errors are multiplied by `unit_length`.
    """
    half = 0.5 * 10.0**-DECIMALS
    return max(math.sqrt(3) * half / 1000, 3 * math.radians(half) * robot.unit_length)


def rounded(number: float, digits: int) -> float:
    """Return a rounded number, without the sign of -0."""
    return round(float(number), digits) + 0.0


def shown_unit(unit: str) -> str:
    """Return the unit in which `shown` prints a value: deg for angles, mm for lengths."""
    return {ANGLE: "deg", LENGTH: "mm"}.get(unit, unit)
