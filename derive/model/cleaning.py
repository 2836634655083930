"""Records which numbers of a file were replaced by exact values, and the effect on the pose."""

from collections.abc import Iterable
from dataclasses import dataclass
from decimal import ROUND_CEILING, Context, Decimal
from typing import Literal

import sympy as sp

from .tolerances import LARGE_CLEANING, NOISE

CleanedUnit = Literal["m", "rad", "1"]
_UPWARDS = Context(prec=2, rounding=ROUND_CEILING)
_PLACES = 6
"""Maximum number of leading zeros of a number without an exponent."""


@dataclass(frozen=True)
class CleanedNumber:
    """A number of a description that was replaced by an exact value.

    Attributes:
        at: Name of the joint or parameter, or "base" or "tool".
        field: Name of the field or component, such as alpha, x or roll. For a parameter, the name
            of the field is empty.
        found: The exact value of the written number (meter, radian or 1).
        taken: The exact value that the robot uses.
        unit: m, rad, or 1 for a component of a direction.
    """

    at: str
    field: str
    found: sp.Expr
    taken: sp.Expr
    unit: CleanedUnit

    @property
    def change(self) -> float:
        """The used value minus the written value (meter, radian or 1)."""
        return float(sp.N(self.taken - self.found))


@dataclass(frozen=True)
class Cleaning:
    """All cleaned numbers of a description, and their effect on the tool pose.

    Attributes:
        numbers: The cleaned numbers, ordered by joint from the base to the tool.
        position: Upper bound (meter) of the tool displacement that cleaning causes within the joint
            limits.
        orientation: Upper bound (radian) of the tool rotation that cleaning causes within the joint
            limits.
        samples: The number of random configurations from which `position` and `orientation` are
            computed for a robot with loops. If `samples` is 0, both bounds hold for all
            configurations within the joint limits.
    """

    numbers: tuple[CleanedNumber, ...] = ()
    position: float = 0.0
    orientation: float = 0.0
    samples: int = 0

    @property
    def bound(self) -> str:
        """Return the bounds as text.

        An angle of zero is omitted.
        """
        turned = f" and {rounded_up(self.orientation)} rad" if self.orientation else ""
        drawn = f" at {self.samples} random configurations" if self.samples else ""
        return f"{rounded_up(self.position)} m{turned}{drawn}"

    @property
    def line(self) -> str:
        """State how many numbers were cleaned, and how much they move the tool at most.

        The text is empty if no rounded number was replaced.
        """
        count = len(self.numbers)
        if not count:
            return ""
        return f"{count} number{'s' if count > 1 else ''} cleaned, at most {self.bound}"

    @property
    def sentences(self) -> tuple[str, ...]:
        """The numbers that changed by more than rounding errors, with all digits."""
        rounded: dict[tuple[sp.Expr, sp.Expr], list[CleanedNumber]] = {}
        for number in self.numbers:
            if abs(number.change) > NOISE:
                rounded.setdefault((number.found, number.taken), []).append(number)
        return tuple(
            f"{written(found)} interpreted as {sp.sstr(taken)}: {places(numbers)}"
            for (found, taken), numbers in rounded.items()
        )

    @property
    def warning(self) -> str:
        """List the cleaned numbers if cleaning moves the tool by more than ``LARGE_CLEANING``."""
        if self.position <= LARGE_CLEANING:
            return ""
        numbers = "; ".join(self.sentences) or f"{len(self.numbers)} numbers without their noise"
        return (
            f"exact values for rounded numbers move the tool by up to {self.bound} ({numbers}); "
            "--exact, or exact=True in Python, keeps all numbers as written"
        )


def places(numbers: Iterable[CleanedNumber]) -> str:
    """List fields and their joints or frames, such as ``alpha, theta of joint2; x of tool``."""
    fields: dict[str, list[str]] = {}
    for number in numbers:
        fields.setdefault(number.at, []).append(number.field)
    return "; ".join(
        f"{', '.join(names)} of {at}" if any(names) else at for at, names in fields.items()
    )


def rounded_up(bound: float) -> str:
    """Round a bound up to two digits."""
    return f"{float(_UPWARDS.create_decimal(repr(bound))):.2g}"


def decimal_places(value: sp.Expr) -> int | None:
    """Return the number of decimal places of a finite decimal.

    The result is None if the number is not a finite decimal.
    """
    if not value.is_Rational:
        return None
    places, rest = 0, value.q
    for prime in (2, 5):
        power = 0
        while rest % prime == 0:
            rest, power = rest // prime, power + 1
        places = max(places, power)
    return places if rest == 1 else None


def written(value: sp.Expr) -> str:
    """Format a number as in a file, with all decimal places or as a rational number of degrees."""
    places = decimal_places(value)
    if places is not None:
        digits = str(value.p * 10**places // value.q)
        return _decimal(Decimal(digits + f"E-{places}"))
    degrees = value * 180 / sp.pi
    if decimal_places(degrees) is not None:
        return f"{written(degrees)} deg"
    return str(sp.sstr(value))


def _decimal(value: Decimal) -> str:
    if value and value.adjusted() < -_PLACES:
        sign, digits, _ = value.as_tuple()
        text = "".join(map(str, digits)).rstrip("0")
        point = f".{text[1:]}" if text[1:] else ""
        return f"{'-' if sign else ''}{text[0]}{point}e{value.adjusted()}"
    return format(value, "f")
