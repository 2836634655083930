"""Formats lengths, angles and their intervals in messages about loops."""

import math

DIGITS, DECIMALS = 4, 6
UNITS = {True: ("mm", 1000.0), False: ("deg", 180 / math.pi)}
"""Display unit and conversion factor from meter or radian, keyed by True for a length and False for
an angle."""


def shown(value: float, is_length: bool) -> str:
    """Format a length in millimeters or an angle in degrees, with four significant digits."""
    unit, factor = UNITS[is_length]
    shortened = round(value * factor, DECIMALS) + 0.0
    return f"{shortened:.{DIGITS}g} {unit}"


def interval(low: float | None, high: float | None, is_length: bool) -> str:
    """Format an interval of lengths or angles, with its bounds rounded inwards."""
    unit, factor = UNITS[is_length]
    bottom = None if low is None else _inwards(low * factor, up=True)
    top = None if high is None else _inwards(high * factor, up=False)
    if bottom is None and top is None:
        return "any other"
    if low is not None and high is not None and high - low < 1e-3 * abs(high):
        return shown((low + high) / 2, is_length)
    if top is None:
        return f"{bottom} {unit} or more"
    if bottom is None:
        return f"{top} {unit} or less"
    return f"{bottom} {unit}" if bottom == top else f"{bottom} to {top} {unit}"


def _inwards(value: float, *, up: bool) -> str:
    if value == 0:
        return "0"
    digit = 10.0 ** (math.floor(math.log10(abs(value))) - DIGITS + 1)
    steps = math.ceil(value / digit - 1e-3) if up else math.floor(value / digit + 1e-3)
    return f"{steps * digit + 0.0:.{DIGITS}g}"
