"""Writes exact numbers for robot files and URDF.

The reader of robot files replaces a decimal that looks rounded with an exact value (module
``noise``). Therefore the writer replaces each decimal that looks rounded with a fraction of
denominator 3, which the reader keeps unchanged.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Context, Decimal
from fractions import Fraction

import mpmath
import sympy as sp

from ..description.noise import exact_angle, exact_direction, without_noise
from ..description.pose_error import robot_size
from ..model.cleaning import decimal_places
from ..model.convention import FieldKind
from ..model.exact import LONGEST_TEXT
from ..model.placements import Vector
from ..model.robot import SerialRobot
from ..model.tolerances import EVALUATION_DIGITS, NOISE
from ..model.values import Values

DIGITS = 17
"""Significant digits of a number that has no short exact form. A double has 17 significant digits.
"""
_PLACES = 16
"""Number of decimal places of the lengths in a joint table (meter)."""
_LONGEST = 40
"""Maximum number of digits of a decimal that is written without rounding."""
_SAME = sp.Rational(1, 10**16)
"""Maximum error of a number that is written as text and read back [m, rad or 1]."""
_EXACT = Context(prec=200)
_PLAIN = 6
"""Maximum number of leading zeros of a decimal that is written without an exponent."""


def digits_for(size: float) -> int:
    """Return the number of significant digits for a table with lengths up to ``size`` (meter).

    The angles of a table have as many digits as its lengths.
    """
    return max(DIGITS, _PLACES + 1 + math.floor(math.log10(max(size, 1.0))))


def rounded(value: sp.Expr, digits: int = DIGITS) -> sp.Expr:
    """Round a decimal to ``digits`` digits.

    Numbers without a finite decimal representation do not change.
    """
    places = decimal_places(value)
    if not places or _digits(value, places) <= digits:
        return value
    return sp.Rational(nearest(value, digits))


def nearest(value: sp.Expr, digits: int = DIGITS) -> str:
    """Return a number as a decimal, rounded to ``digits`` significant digits."""
    with mpmath.workdps(EVALUATION_DIGITS):
        text = mpmath.nstr(Values().of(value), digits)
    return _decimal_text(Decimal(text))


@dataclass(frozen=True)
class NumberText:
    """Converts the numbers of a robot to the text of its robot file.

    Attributes:
        noise: Maximum rounding error (meter) that the reader of robot files removes from a length.
    """

    noise: Fraction

    @classmethod
    def of(cls, robot: SerialRobot) -> "NumberText":
        """Return an object that formats the numbers of a robot."""
        return cls(2 * Fraction(NOISE * (robot_size(robot) or 1.0)))

    def field(self, value: sp.Expr | Vector, kind: FieldKind) -> str:
        """Return the text of the value of a convention field."""
        if not isinstance(value, tuple):
            return self.scalar(value, kind)
        if kind == "direction":
            return self._direction(value)
        return f"[{', '.join(self.scalar(part, kind) for part in value)}]"

    def scalar(self, value: sp.Expr, kind: str) -> str:
        """Return a number as text, or as a quoted expression if the reader would change the number.

        Args:
            value: An exact number, or an expression with parameters.
            kind: Quantity that the number measures: "length", "angle" or another name.
        """
        return _guarded(value) if abs(self._read(value, kind) - value) > _SAME else literal(value)

    def _read(self, value: sp.Expr, kind: str) -> sp.Expr:
        """Return the value that the reader of robot files returns for a written number."""
        if value == 0 or value.free_symbols:
            return value
        if kind.startswith("angle"):
            return exact_angle(value)
        return without_noise(value, self.noise) if kind.startswith("length") else value

    def _direction(self, axis: Vector) -> str:
        changes = (abs(a - b) for a, b in zip(exact_direction(axis), axis, strict=True))
        is_kept = all(Values().of(change) <= _SAME for change in changes)
        parts = [literal(part) if is_kept or part == 0 else _guarded(part) for part in axis]
        return f"[{', '.join(parts)}]"


def literal(value: sp.Expr) -> str:
    """Return an exact number for a robot file: a decimal, or an expression in quotes."""
    places = decimal_places(value)
    if places is not None:
        digits = _decimal(value)
        if len(digits.as_tuple().digits) <= _LONGEST:
            return _decimal_text(digits)
    text = str(sp.sstr(value))
    return f'"{text}"' if value.free_symbols or len(text) <= LONGEST_TEXT else nearest(value)


def literals(values: Sequence[sp.Expr]) -> str:
    """Return a list of exact numbers for a robot file."""
    return f"[{', '.join(map(literal, values))}]"


def _guarded(value: sp.Expr) -> str:
    """Return a decimal as a fraction, so that the file reader does not change its value."""
    count = max(DIGITS, _digits(value, decimal_places(value) or 0))
    triple = Decimal(nearest(3 * value, count))
    digits = triple.scaleb(count - 1 - triple.adjusted()).to_integral_value()
    # If the numerator is a multiple of 3, the digit 1 is appended, because the fraction would
    # otherwise equal a finite decimal.
    step = Decimal(0) if int(digits) % 3 else Decimal("0.1")
    return f'"{_decimal_text((digits + step).scaleb(triple.adjusted() - count + 1))}/3"'


def _digits(value: sp.Rational, places: int) -> int:
    return len(str(abs(value.p * 10**places // value.q)))


def _decimal(value: sp.Expr) -> Decimal:
    return _EXACT.divide(Decimal(value.p), Decimal(value.q))


def _decimal_text(number: Decimal) -> str:
    number = number.normalize(_EXACT)
    if number == 0:
        return "0"
    is_plain = -_PLAIN <= number.adjusted() <= DIGITS
    return f"{number:f}" if is_plain else f"{number:e}"
