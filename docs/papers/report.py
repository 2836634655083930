"""Creates tables that compare the printed numbers of papers with the values of chasles.

Each table row states a verdict, and the script stops if the verdict is wrong.

The script of each paper has two functions. The function `rows()` returns the table of the paper as
a list of `Row`. The function `figures()` returns a dict from each caption to a matplotlib figure,
or to a function that writes an animation to a GIF path. `printed_items.py` reads the printed values
of a paper.

The command ``python docs/papers/photo_robot.py`` prints the table of one paper. The command
``python docs/papers/report.py`` writes all tables and pictures to build/reproduce. With the option
``--write``, the command also writes the pages in docs.
"""

from __future__ import annotations

import re
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
    unit_word,
)

__all__ = [
    "Figures",
    "Finding",
    "Printed",
    "Refuted",
    "Row",
    "Verdict",
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
SYMBOLS = ("acos", "alpha", "beta", "phi", "theta")
"""Symbols that keep their small first letter at the start of a sentence."""
Equation = Callable[[Printed], Value]
"""Function that evaluates the printed equations of an item of the paper."""
ECHO = "the value is an input, copied from the paper"
"""Note for a table row whose value is only an input of the paper."""
MISSING = "our copy lacks the figure"
"""Note for a value in a figure that our copy of the paper lacks."""
TWICE = "both values come from the same model, computed twice"
"""Note for a value that the paper does not print, computed by chasles and by independent code."""

ROUNDING = 1e-9
"""Largest relative rounding error that an evaluated equation may have."""
EDGE = 1e-12
"""Relative amount by which the agreement interval is widened, because decimal bounds such as 0.655
have no exact floating-point value."""
_MAX_DECIMALS = 12
_MAX_SHOWN = 6
"""Maximum number of equation values that a table row shows. A row with more values shows only their
number."""


class Refuted(AssertionError):
    """The compared values contradict the verdict of a table row, or the row is incomplete."""


@dataclass(frozen=True)
class Finding:
    """The result of checking a statement in the text of a paper.

    Attributes:
        holds: Whether the paper's statement is true.
        evidence: Text in the table with the numbers that confirm or refute the statement.
    """

    holds: bool
    evidence: str


@dataclass(frozen=True)
class Row:
    """A row in the table of a paper.

    Attributes:
        item: Name of the item.
        printed: Printed value [unit], or None if our copy lacks the value or the paper prints no
            value. A number in brackets is not printed, but evaluated by equations of the paper.
        ours: The value that chasles computes [unit], or None.
        unit: The unit of `printed` and `ours`.
        verdict: The result of the comparison of `printed` and `ours`.
        where: Page, table, figure or equation of the item in the paper.
        note: A remark, such as the corrected value, an interpretation that we tried, or an
            assumption.
        digits: Number of decimals of `ours` in the table, if `ours` is a number.
        source: The printed item that the row compares.
        judge: Function that repeats the comparison for a changed printed item, and returns the new
            row.
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
        """Format the printed value and our value for the tables."""
        printed = _number(self.printed, self.digits) if self.printed is not None else "-"
        return printed, _number(self.ours, self.digits) if self.ours is not None else "-"


def _repeatable(verdict: Callable[..., Row]) -> Callable[..., Row]:
    @wraps(verdict)
    def judged(printed: Printed, *values: Any, **named: Any) -> Row:
        row = verdict(printed, *values, **named)
        return replace(row, source=printed, judge=lambda other: verdict(other, *values, **named))

    return judged


@_repeatable
def agrees(
    printed: Printed, ours: Value, note: str = "", *, evaluated: Equation | None = None
) -> Row:
    """Assert that our value agrees with the printed value, within the printed precision.

    Args:
        printed: A number, table or statement that the paper prints.
        ours: The value that chasles computes, in meters, radians and seconds, with the shape of the
            printed value. For a statement in words, `ours` is a `Finding`.
        note: Information that a reader needs to interpret the row.
        evaluated: Function that evaluates a printed equation, with which our value must agree
            except for rounding errors.

    Raises:
        Refuted: The printed value differs from our value, or the paper does not print the value.
    """
    if printed.is_evaluated:
        raise Refuted(f"item {printed.item} has no printed value; use `consistent`")
    return _agreeing(printed, ours, "agrees", note, evaluated)


@_repeatable
def consistent(
    printed: Printed, ours: Value, reason: str = ECHO, *, evaluated: Equation | None = None
) -> Row:
    """Assert that our value is consistent with the paper.

    Agreement with our value does not prove that the printed value is correct.

    Raises:
        Refuted: The printed value differs from our value, or `reason` is empty.
    """
    if not reason:
        raise Refuted(f"item {printed.item} has no reason")
    return _agreeing(printed, ours, "consistency", reason, evaluated)


@_repeatable
def in_one_reading(printed: Printed, ours: Value, reading: str) -> Row:
    """Assert that both values agree under an interpretation that the paper does not state.

    Raises:
        Refuted: The printed value differs from our value, or `reading` is empty.
    """
    if not reading:
        raise Refuted(f"item {printed.item} states no interpretation of the paper")
    return _agreeing(printed, ours, "one reading", reading, None)


def _agreeing(
    printed: Printed, ours: Value, verdict: Verdict, note: str, evaluated: Equation | None
) -> Row:
    if printed.value is None:
        raise Refuted(f"item {printed.item} has no printed value")
    value = _equation_value(printed, evaluated)
    if not _same(printed.value if value is None else value, ours, printed):
        raise _refuted(printed, ours, "differs from")
    if np.size(value) > _MAX_SHOWN:
        equations = f"{np.size(value)} entries"
        return Row(printed.item, equations, "the same", "", verdict, printed.where, note)
    if printed.about is not None:
        tolerance = f"the tolerance is ± {printed.about} {printed.unit}".rstrip()
        words = f"{tolerance}, because the paper says “{printed.text}”"
        note = _sentences((words, note))
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
    """Assert that the printed value is wrong and that a corrected value is right.

    Args:
        printed: The printed item.
        ours: The value that chasles computes, in meters, radians and seconds. For a statement in
            words, `ours` is a `Finding`.
        corrected: The correct value. A string in `corrected` is in the item's unit and accurate to
            half a unit of its last digit. Numbers and arrays in `corrected` are in meters, radians
            and seconds, and accurate to rounding errors. A `Finding` in `corrected` contains the
            corrected statement as a sentence.
        note: What is wrong.
        evaluated: Function that evaluates a printed equation in the units of `ours`.
        cause: Cause of the wrong printed value, and the value that results from this cause. The
            cause is a noun phrase that completes “the printed value results from”.

    Raises:
        Refuted: The printed value agrees with our value, the corrected value differs from our
            value, or `cause` does not give the printed value.
    """
    value = _equation_value(printed, evaluated)
    wrong = printed.value if value is None else value
    if wrong is None or _same(wrong, ours, printed):
        raise _refuted(printed, ours, "agrees with")
    if isinstance(corrected, Finding):
        is_right = corrected.holds
    else:
        is_right = _same(corrected, ours, replace(printed, about=None))
    if not is_right:
        raise _refuted(printed, ours, f"corrected to {corrected} differs from")
    if cause is not None and not _same(wrong, cause[1], printed):
        raise _refuted(printed, cause[1], f"is not caused by {cause[0]}:")
    read_instead = ""
    if isinstance(corrected, Finding):
        read_instead = corrected.evidence
    elif isinstance(corrected, str):
        read_instead = f"the correct value is {corrected} {unit_word(printed.unit)}".strip()
    words = (_sentences((read_instead, note)), f"cause: {cause[0]}" if cause else "")
    row = _row(printed, ours, "erratum", "; ".join(filter(None, words)))
    return _with_value(row, printed, value)


def _equation_value(printed: Printed, evaluated: Equation | None) -> Value:
    return None if evaluated is None else evaluated(printed)


def _with_value(row: Row, printed: Printed, value: Value) -> Row:
    """Add the value of an equation to its table row."""
    if value is None:
        return row
    shown = _number(_shown(value, printed, row.digits), row.digits)
    return replace(row, printed=f"{row.printed} = {shown}" if row.printed else shown)


@_repeatable
def assumed(printed: Printed, ours: Value, reason: str) -> Row:
    """Return a row for a value that the paper needs but does not print, with our reason.

    Raises:
        Refuted: The paper prints a value for the item, or `reason` is empty.
    """
    return _without_value(printed, ours, "assumed", reason)


@_repeatable
def lost(printed: Printed, ours: Value, reason: str) -> Row:
    """Return a row with our value for a value or curve that our copy of the paper lacks.

    Raises:
        Refuted: The paper prints a value for the item, or `reason` is empty.
    """
    return _without_value(printed, ours, "lost", reason)


@_repeatable
def not_printed(printed: Printed, ours: Value, reason: str) -> Row:
    """Return a row for a value that the paper neither prints nor needs.

    Raises:
        Refuted: The paper prints a value for the item, or `reason` is empty.
    """
    return _without_value(printed, ours, "not printed", reason)


def _without_value(printed: Printed, ours: Value, verdict: Verdict, reason: str) -> Row:
    if printed.value is not None or not reason:
        raise Refuted(f"item {printed.item} must have no printed value, and must state a reason")
    return _row(printed, ours, verdict, reason)


@_repeatable
def not_reproducible(
    printed: Printed, ours: Value, note: str = "", *, readings: Mapping[str, Value] | None = None
) -> Row:
    """Assert that the printed value does not follow from the paper.

    Args:
        printed: The printed item.
        ours: The value that chasles computes, in meters, radians and seconds.
        note: Information that a reader needs to interpret the row.
        readings: Other interpretations of the paper that we tried, each with its value.

    Raises:
        Refuted: The printed value agrees with our value or with a value in `readings`, or both
            `note` and `readings` are empty.
    """
    readings = readings or {}
    if printed.value is None or not (note or readings):
        raise _refuted(printed, ours, "has neither a note nor an interpretation; our value is")
    for value in (ours, *readings.values()):
        if _same(printed.value, value, printed):
            raise _refuted(printed, value, "is reproducible by")
    row = _row(printed, ours, "not reproducible", note)
    tried = [
        f"{_number(_shown(value, printed, row.digits), row.digits)} {printed.unit} for {reading}"
        for reading, value in readings.items()
    ]
    others = ""
    if tried:
        others = (
            "other interpretations of the paper do not give the printed value either: they give "
            f"{listed(tried)}"
        )
    words = (others, note)
    return replace(row, note=_sentences(words))


def _sentences(parts: Sequence[str]) -> str:
    """Join the sentences of a note, without a period after the last sentence."""
    first, *others = [part for part in parts if part] or [""]
    return ". ".join([first, *map(capitalized, others)])


def listed(parts: Sequence[str]) -> str:
    """Join parts by commas, with the word "and" before the last part."""
    *others, last = parts
    return f"{', '.join(others)} and {last}" if others else last


def capitalized(note: str) -> str:
    """Return a note with a capital first letter, unless it starts with a symbol or number."""
    first = re.match(r"[a-z]+(?=[\s,:])", note)
    if first and len(first[0]) > 1 and first[0] not in SYMBOLS:
        return note[0].upper() + note[1:]
    return note


def _same(value: Value, ours: Value, printed: Printed) -> bool:
    """Test whether our value agrees with a printed value, or with the value of an equation."""
    if isinstance(ours, Finding):
        if not isinstance(value, str) or decimal(value) is not None:
            raise Refuted(f"item {printed.item}: expected a statement in words, got {value}")
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
            raise Refuted(
                f"item {printed.item}: got a number, but the paper prints the words {value!r}"
            )
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
    """Test whether our rounded number differs from the printed number by exactly the tolerance."""
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
    """Return the largest number of decimals of the printed numbers."""
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
    """Format a number with its decimals, without negative zero."""
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
    """Print the table of a paper."""
    lines = [
        (row.verdict, row.item, *row.shown, row.unit, f"{row.where}. {row.note}") for row in rows
    ]
    widths = [max(len(line[k]) for line in lines) for k in range(5)]
    for line in lines:
        cells = [cell.ljust(width) for cell, width in zip(line[:5], widths, strict=True)]
        print("  ".join([*cells, line[5]]).rstrip())


Picture = Any
"""A matplotlib figure, or a function that writes an animation as GIF to a path."""
Figures = dict[str, "Picture | Callable[[Path], None]"]


if __name__ == "__main__":
    import pages

    sys.exit(pages.main(sys.argv[1:]))
