"""The numbers of a file that were taken for exact ones, and the pose error that this may cause."""

from collections.abc import Iterable
from dataclasses import dataclass
from decimal import ROUND_CEILING, Context, Decimal
from typing import Literal

import sympy as sp

from .tolerances import LARGE_CLEANING, NOISE

CleanedUnit = Literal["m", "rad", "1"]
_UPWARDS = Context(prec=2, rounding=ROUND_CEILING)
_PLACES = 6
"""Places after which zeros of a small number are written as a power of ten."""


@dataclass(frozen=True)
class CleanedNumber:
    """A number of a description that was not taken as it is written.

    Attributes:
        at: The joint, "base", "tool" or the parameter that has it.
        field: The field's or the component's name, such as alpha, x or roll; "" for a parameter.
        found: The number as written (metre, radian or 1), exact.
        taken: The number that the robot has instead.
        unit: m, rad, or 1 for a component of a direction.
    """

    at: str
    field: str
    found: sp.Expr
    taken: sp.Expr
    unit: CleanedUnit

    @property
    def change(self) -> float:
        """The number taken minus the number found (metre, radian or 1)."""
        return float(sp.N(self.taken - self.found))


@dataclass(frozen=True)
class Cleaning:
    """All numbers of a description that were cleaned, and their effect together.

    Attributes:
        numbers: In order from the base.
        position: Bound of the distance (metre) between the tool's positions as described and as
            taken, at any joint values within the limits.
        orientation: Bound of the angle (radian) between the tool's orientations.
        samples: Of a robot with loops, the number of random configurations at which the distance
            and the angle were the largest; 0 where they are bounds everywhere.
    """

    numbers: tuple[CleanedNumber, ...] = ()
    position: float = 0.0
    orientation: float = 0.0
    samples: int = 0

    @property
    def bound(self) -> str:
        """The bounds in words; an angle that cannot change is left out."""
        turned = f" and {rounded_up(self.orientation)} rad" if self.orientation else ""
        drawn = f" at {self.samples} random configurations" if self.samples else ""
        return f"{rounded_up(self.position)} m{turned}{drawn}"

    @property
    def line(self) -> str:
        """The number of cleaned numbers with the bounds; empty where there is none."""
        count = len(self.numbers)
        if not count:
            return ""
        return f"{count} number{'s' if count > 1 else ''} cleaned, at most {self.bound}"

    @property
    def sentences(self) -> tuple[str, ...]:
        """The numbers that were changed by more than noise, each value with all its places."""
        rounded: dict[tuple[sp.Expr, sp.Expr], list[CleanedNumber]] = {}
        for number in self.numbers:
            if abs(number.change) > NOISE:
                rounded.setdefault((number.found, number.taken), []).append(number)
        return tuple(
            f"{written(found)} taken as {sp.sstr(taken)}: {places(numbers)}"
            for (found, taken), numbers in rounded.items()
        )

    @property
    def warning(self) -> str:
        """The change in words if it moves the tool by more than ``LARGE_CLEANING``, else empty."""
        if self.position <= LARGE_CLEANING:
            return ""
        numbers = "; ".join(self.sentences) or f"{len(self.numbers)} numbers without their noise"
        return (
            f"exact numbers for rounded ones move the tool by up to {self.bound} ({numbers}); "
            "--exact, or exact=True in Python, takes all numbers as written"
        )


def places(numbers: Iterable[CleanedNumber]) -> str:
    """Fields with their owners, ``alpha, theta of joint2; x of tool``."""
    fields: dict[str, list[str]] = {}
    for number in numbers:
        fields.setdefault(number.at, []).append(number.field)
    return "; ".join(
        f"{', '.join(names)} of {at}" if any(names) else at for at, names in fields.items()
    )


def rounded_up(bound: float) -> str:
    """A bound to two digits, never below itself."""
    return f"{float(_UPWARDS.create_decimal(repr(bound))):.2g}"


def decimal_places(value: sp.Expr) -> int | None:
    """Places after the point that a finite decimal needs; None for another number."""
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
    """A number as files write it: decimals in full, angles of rational degrees in degrees."""
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
