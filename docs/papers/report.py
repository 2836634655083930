"""Papers beside chasles: each printed number next to ours, with a verdict that is asserted.

Each script of this folder has two functions. `rows()` returns a list of `Row`, `figures()` a dict
from the caption of a figure to the matplotlib figure, or to a function that writes an animation to
the GIF that it is given. `printed_items.py` reads what a paper prints.

    $ python docs/papers/photo_robot.py       # the table of one paper
    $ python docs/papers/report.py            # all tables and pictures in build/reproduce
    $ python docs/papers/report.py --write    # the same, and the pages in docs anew
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from functools import wraps
from pathlib import Path
from typing import Any, Literal

import numpy as np
from printed_items import (
    UNITS,
    Printed,
    Text,
    Value,
    at,
    decimal,
    evaluated,
    read,
    texts,
    tolerance,
)

__all__ = [
    "Figures",
    "Finding",
    "Printed",
    "Refuted",
    "Row",
    "agrees",
    "assumed",
    "at",
    "consistent",
    "erratum",
    "evaluated",
    "in_one_reading",
    "lost",
    "not_printed",
    "not_reproducible",
    "read",
    "show",
]

Verdict = Literal[
    "agrees",
    "erratum",
    "one reading",
    "not reproducible",
    "consistency",
    "assumed",
    "lost",
    "not printed",
]
Equation = Callable[[Printed], Value]
"""Evaluates the equations of an item."""
ECHO = "an input of chasles"
"""Reason of rows that compare an input with the number from which it was copied."""
TWICE = "two computations of one model"
"""Reason of rows that compare chasles with other computations by the paper's equations."""

ROUNDING = 1e-9
"""Part of a value that the arithmetic of an equation may lose."""
EDGE = 1e-12
"""Part of a number by which the edge of agreement is widened: a printed 0.65 stands for numbers up
to 0.655, which no float is exactly."""
_MAX_DECIMALS = 12
_MAX_SHOWN = 6
"""Entries of equations whose values the tables show."""


class Refuted(AssertionError):
    """A verdict that the numbers do not bear out."""


@dataclass(frozen=True)
class Finding:
    """What chasles finds on a statement in words.

    Attributes:
        holds: Whether the statement is true.
        evidence: The numbers that show it, for the table.
    """

    holds: bool
    evidence: str


@dataclass(frozen=True)
class Row:
    """A line of a paper's table.

    Attributes:
        item: Its name.
        printed: The value as printed [unit], in brackets where it was evaluated; None: not
            printed, or lost.
        ours: The value by chasles [unit]; None where there is none.
        unit: The unit of both.
        verdict: What comparing them gave.
        where: Where the item stands in the paper.
        note: The corrected value, the paper's "about", what was tried or assumed.
        digits: Decimals to which `ours` is shown where it is a number.
        source: The item that was judged.
        judge: Asserts the verdict of another item in its place.
    """

    item: str
    printed: float | str | None
    ours: float | str | None
    unit: str
    verdict: Verdict
    where: str
    note: str = ""
    digits: int = 6
    source: Printed | None = field(default=None, repr=False, compare=False)
    judge: Callable[[Printed], Row] | None = field(default=None, repr=False, compare=False)

    @property
    def shown(self) -> tuple[str, str]:
        """The printed value and ours as the tables show them."""
        printed = _number(self.printed, self.digits) if self.printed is not None else "-"
        return printed, _number(self.ours, self.digits) if self.ours is not None else "-"


def _repeatable(verdict: Callable[..., Row]) -> Callable[..., Row]:
    """Keeps with the row how its verdict is asserted, so that other digits can be judged."""

    @wraps(verdict)
    def judged(printed: Printed, *values: Any, **named: Any) -> Row:
        row = verdict(printed, *values, **named)
        return replace(row, source=printed, judge=lambda other: verdict(other, *values, **named))

    return judged


@_repeatable
def agrees(
    printed: Printed, ours: Value, note: str = "", *, evaluated: Equation | None = None
) -> Row:
    """The value agrees with the printed one to half a unit of its last digit, or to its "about".

    Args:
        printed: The item; its value is a number, words or rows of them.
        ours: The value by chasles in metres, radians and seconds, shaped like the printed one; a
            `Finding` for a statement.
        note: What a reader should know.
        evaluated: Evaluates the printed equations, where the item is one: ours is the same to
            rounding.

    Raises:
        Refuted: It does not agree, or the paper does not print the value.
    """
    if printed.is_evaluated:
        raise Refuted(f"{printed.item}: the paper does not print the value; it is consistent")
    return _agreeing(printed, ours, "agrees", note, evaluated)


@_repeatable
def consistent(
    printed: Printed, ours: Value, reason: str = ECHO, *, evaluated: Equation | None = None
) -> Row:
    """The value agrees, and proves nothing of the paper: an input, or one model computed twice.

    Raises:
        Refuted: It does not agree, or the reason is empty.
    """
    if not reason:
        raise Refuted(f"{printed.item}: no reason is given")
    return _agreeing(printed, ours, "consistency", reason, evaluated)


@_repeatable
def in_one_reading(printed: Printed, ours: Value, reading: str) -> Row:
    """The value agrees in a reading that the paper does not state.

    Raises:
        Refuted: It does not agree, or the reading is not named.
    """
    if not reading:
        raise Refuted(f"{printed.item}: the reading is not named")
    return _agreeing(printed, ours, "one reading", reading, None)


def _agreeing(
    printed: Printed, ours: Value, verdict: Verdict, note: str, evaluated: Equation | None
) -> Row:
    if printed.value is None:
        raise Refuted(f"{printed.item}: nothing is printed that could agree")
    value = _equation_value(printed, evaluated)
    if not _same(printed.value if value is None else value, ours, printed):
        raise _refuted(printed, ours, "does not agree with")
    if np.size(value) > _MAX_SHOWN:
        equations = f"{np.size(value)} entries"
        return Row(printed.item, equations, "the same", "", verdict, printed.where, note)
    if printed.about is not None:
        note = "; ".join(filter(None, (f"“{printed.text}”: ± {printed.about}", note)))
    return _with_value(_row(printed, ours, verdict, note), printed, value)


@_repeatable
def erratum(
    printed: Printed,
    ours: Value,
    corrected: Value,
    note: str = "",
    *,
    evaluated: Equation | None = None,
    cause: tuple[str, Value] | None = None,
) -> Row:
    """The printed value is wrong, and a corrected one right.

    Args:
        printed: The item.
        ours: The value by chasles in metres, radians and seconds; a `Finding` for a statement.
        corrected: The value that should be printed: a string in the item's unit, to half a unit of
            its last digit; or a number or array in metres, radians and seconds that follows from a
            corrected equation, to rounding; a `Finding` on the corrected statement.
        note: What is wrong.
        evaluated: Evaluates the printed equation, where the item is an equation, as `ours`.
        cause: How the paper came to its value, in words, and that value, as `ours` or as a string.

    Raises:
        Refuted: The printed value agrees with ours, or the corrected one does not, or the cause
            does not give the printed value.
    """
    value = _equation_value(printed, evaluated)
    wrong = printed.value if value is None else value
    if wrong is None or _same(wrong, ours, printed):
        raise _refuted(printed, ours, "is no erratum beside")
    if isinstance(corrected, Finding):
        is_right = corrected.holds
    else:
        is_right = _same(corrected, ours, replace(printed, about=None))
    if not is_right:
        raise _refuted(printed, ours, f"corrected to {corrected} does not agree with")
    if cause is not None and not _same(wrong, cause[1], printed):
        raise _refuted(printed, cause[1], f"does not follow from {cause[0]},")
    right = corrected.evidence if isinstance(corrected, Finding) else corrected
    right = right if isinstance(right, str) else ""
    read_instead = f"read {right} {printed.unit}".strip() if right else ""
    words = (read_instead, note, f"cause: {cause[0]}" if cause else "")
    row = _row(printed, ours, "erratum", "; ".join(filter(None, words)))
    return _with_value(row, printed, value)


def _equation_value(printed: Printed, evaluated: Equation | None) -> Value:
    return None if evaluated is None else evaluated(printed)


def _with_value(row: Row, printed: Printed, value: Value) -> Row:
    """The row of an equation, with its value behind it."""
    if value is None:
        return row
    shown = _number(_shown(value, printed, row.digits), row.digits)
    return replace(row, printed=f"{row.printed} = {shown}" if row.printed else shown)


@_repeatable
def assumed(printed: Printed, ours: Value, reason: str) -> Row:
    """A value that the paper needs and does not print: the one that we chose, and why.

    Raises:
        Refuted: The paper prints a value, or the reason is empty.
    """
    return _without_value(printed, ours, "assumed", reason)


@_repeatable
def lost(printed: Printed, ours: Value, reason: str) -> Row:
    """A value or a curve that the text of the paper no longer has, with ours in its place.

    Raises:
        Refuted: The paper prints a value, or the reason is empty.
    """
    return _without_value(printed, ours, "lost", reason)


@_repeatable
def not_printed(printed: Printed, ours: Value, reason: str) -> Row:
    """A value that the paper neither prints nor needs: ours adds to the paper.

    Raises:
        Refuted: The paper prints a value, or the reason is empty.
    """
    return _without_value(printed, ours, "not printed", reason)


def _without_value(printed: Printed, ours: Value, verdict: Verdict, reason: str) -> Row:
    if printed.value is not None or not reason:
        raise Refuted(f"{printed.item}: {printed.value} is printed, or no reason is given")
    return _row(printed, ours, verdict, reason)


@_repeatable
def not_reproducible(
    printed: Printed, ours: Value, note: str = "", *, readings: Mapping[str, Value] | None = None
) -> Row:
    """The printed value does not follow from what the paper states.

    Args:
        printed: The item.
        ours: The value by chasles in metres, radians and seconds.
        note: What a reader should know.
        readings: Other readings that were tried, each with its value.

    Raises:
        Refuted: The value agrees after all, or a reading does, or nothing was tried.
    """
    readings = readings or {}
    if printed.value is None or not (note or readings):
        raise _refuted(printed, ours, "is not said to be tried beside")
    for value in (ours, *readings.values()):
        if _same(printed.value, value, printed):
            raise _refuted(printed, value, "is reproducible by")
    row = _row(printed, ours, "not reproducible", note)
    tried = [
        f"{reading} ({_number(_shown(value, printed, row.digits), row.digits)})"
        for reading, value in readings.items()
    ]
    words = (f"tried: {', '.join(tried)}" if tried else "", note)
    return replace(row, note="; ".join(filter(None, words)))


def _same(value: Value, ours: Value, printed: Printed) -> bool:
    """Whether ours is a printed value (texts in its unit), or a computed one (to rounding)."""
    if isinstance(ours, Finding):
        if not isinstance(value, str) or decimal(value) is not None:
            raise Refuted(f"{printed.item}: expected words for a finding, got {value}")
        return ours.holds
    if isinstance(value, tuple):
        return len(value) == len(ours) and all(
            _same(part, own, printed) for part, own in zip(value, ours, strict=True)
        )
    if isinstance(value, str):
        number = decimal(value)
        if isinstance(ours, str):
            return value == ours
        if number is None:
            raise Refuted(f"{printed.item}: the words “{value}” are compared with a number")
        half = float(tolerance(printed, number))
        room = half + EDGE * max(half, abs(float(number)))
        return bool(abs(float(ours) / UNITS[printed.unit] - float(number)) <= room)
    size = max(1.0, float(np.max(np.abs(ours))))
    return np.shape(value) == np.shape(ours) and bool(
        np.max(np.abs(np.asarray(value) - np.asarray(ours))) <= ROUNDING * size
    )


def _row(printed: Printed, ours: Value, verdict: Verdict, note: str) -> Row:
    digits = printed.digits
    if digits is None:
        digits = min(_decimals(printed.value) + 1, _MAX_DECIMALS)
    while digits < _MAX_DECIMALS and _at_the_edge(printed.value, ours, printed, digits):
        digits += 1
    own = None if ours is None else _shown(ours, printed, digits)
    value = None if printed.value is None else texts(printed.value)
    if printed.is_evaluated:
        value = f"[{value}]"
    return Row(printed.item, value, own, printed.unit, verdict, printed.where, note, digits)


def _at_the_edge(value: Text | None, ours: Value, printed: Printed, digits: int) -> bool:
    """Whether a number, rounded for the table, stands just at the edge of agreement and is not it.

    There a reader cannot see on which side it is.
    """
    if isinstance(ours, Finding | str):
        return False
    if isinstance(value, tuple) and np.ndim(ours) and len(value) == len(ours):
        pairs = zip(value, ours, strict=True)
        return any(_at_the_edge(part, own, printed, digits) for part, own in pairs)
    number = decimal(value) if isinstance(value, str) else None
    if number is None or np.ndim(ours):
        return False
    own = float(ours) / UNITS[printed.unit]
    if not np.isfinite(own):
        return False
    shown = Decimal(f"{own:.{digits}f}")
    exactly = abs(float(shown) - own) <= ROUNDING * max(1.0, abs(own))
    return abs(shown - number) == tolerance(printed, number) and not exactly


def _decimals(value: Text | None) -> int:
    """Decimals of the printed number with the most; 3 where none is printed, 5 of equations."""
    if value is None:
        return 3
    if isinstance(value, tuple):
        return max(map(_decimals, value), default=0)
    number = decimal(value)
    return 5 if number is None else max(0, -int(number.as_tuple().exponent))


def _shown(ours: Value, printed: Printed, digits: int) -> float | str:
    if isinstance(ours, Finding):
        return ours.evidence
    if isinstance(ours, str | int | np.integer):
        return str(ours)
    if isinstance(ours, tuple | list) and any(isinstance(part, str) for part in ours):
        return f"({', '.join(str(_shown(part, printed, digits)) for part in ours)})"
    values = np.asarray(ours, dtype=float) / UNITS[printed.unit]
    return float(values) if values.ndim == 0 else _joined(values, digits)


def _joined(values: Any, digits: int) -> str:
    if np.ndim(values) == 0:
        return _number(float(values), digits)
    return f"({', '.join(_joined(part, digits) for part in values)})"


def _number(value: float | str, digits: int) -> str:
    """A number with its decimals; never a negative zero."""
    if isinstance(value, str):
        return value
    shown = f"{value:.{digits}f}"
    return shown.removeprefix("-") if float(shown) == 0 else shown


def _refuted(printed: Printed, ours: Value, words: str) -> Refuted:
    return Refuted(
        f"{printed.item} ({printed.where}): printed {printed.value} {printed.unit} {words} "
        f"{_shown(ours, printed, _MAX_DECIMALS)} {printed.unit}"
    )


def show(rows: Sequence[Row]) -> None:
    """Prints a paper's table."""
    lines = [
        (row.verdict, row.item, *row.shown, row.unit, f"{row.where}. {row.note}") for row in rows
    ]
    widths = [max(len(line[k]) for line in lines) for k in range(5)]
    for line in lines:
        cells = [cell.ljust(width) for cell, width in zip(line[:5], widths, strict=True)]
        print("  ".join([*cells, line[5]]).rstrip())


Picture = Any
"""A matplotlib figure, or a function that writes an animation to the path of a GIF."""
Figures = dict[str, "Picture | Callable[[Path], None]"]


if __name__ == "__main__":
    import pages

    sys.exit(pages.main(sys.argv[1:]))
