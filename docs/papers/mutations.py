"""Mutation tests of verdicts: if a printed digit is changed, the verdict of its row must fail."""

from __future__ import annotations

import ast
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from typing import TYPE_CHECKING

from printed_items import Printed, Text, decimal, tolerance

if TYPE_CHECKING:
    from report import Row

_NUMBER = re.compile(r"(?<![\w.])\d+(?:\.\d+)?(?![\w.])")
"""Regular expression for a number in an equation, but not for the digit in a symbol such as t2."""
NOTHING = "the paper prints no value"
WORDS = "words, or an equation without digits"
WRONG = "the printed value is wrong, and its cause is unknown"
EXEMPTIONS = (NOTHING, WORDS, WRONG)


@dataclass(frozen=True)
class Digit:
    """A digit of a printed value.

    Attributes:
        path: Indices of the number in the nested lists of the printed value.
        index: Position of the digit within the text of the number.
    """

    path: tuple[int, ...]
    index: int


def exemption(row: Row) -> str:
    """Return the reason why changed digits cannot alter the verdict of a table row.

    The reason is an empty string if changed digits can alter the verdict.
    """
    if row.source is None or row.source.value is None:
        return NOTHING
    if not digits(row):
        return WORDS
    if row.verdict == "not reproducible" or (row.verdict == "erratum" and not has_cause(row)):
        return WRONG
    return ""


def has_cause(row: Row) -> bool:
    """Test whether the note of a table row states the cause of a wrong printed value."""
    return "cause: " in row.note


def exempt(rows: Sequence[Row]) -> Counter[str]:
    """Count the table rows that each reason exempts from digit tests."""
    return Counter(reason for row in rows if (reason := exemption(row)))


def digits(row: Row) -> list[Digit]:
    """List the digits in the printed value of a table row."""
    value = row.source.value if row.source else None
    return [] if value is None else list(_digits(value, ()))


def _digits(value: Text, path: tuple[int, ...]) -> Iterator[Digit]:
    if isinstance(value, tuple):
        for k, part in enumerate(value):
            yield from _digits(part, (*path, k))
        return
    if not is_expression(value):
        return
    for number in _NUMBER.finditer(value):
        yield from (Digit(path, k) for k in range(number.start(), number.end()) if value[k] != ".")


def is_expression(text: str) -> bool:
    """Test whether a text is a number or an equation, and not words."""
    try:
        ast.parse(text.strip(), mode="eval")
    except SyntaxError:
        return False
    return True


def survives(row: Row, digit: Digit) -> bool:
    """Test whether the verdict of a table row fails to detect a changed digit.

    The test increases and decreases the printed value. If the change is just over the tolerance, at
    least one of the two changed values must alter the verdict. If the change is just over twice the
    tolerance, both changed values must alter the verdict.
    """
    if row.source is None or row.judge is None:
        raise ValueError(f"item {row.item} has no function that judges its value")
    near, far = _changes(row.source, digit)
    return all(_holds(row, change) for change in near) or any(_holds(row, c) for c in far)


def _holds(row: Row, changed: Printed) -> bool:
    if row.judge is None:
        raise ValueError(f"item {row.item} has no function that judges its value")
    try:
        return row.judge(changed).verdict == row.verdict
    except (AssertionError, ArithmeticError, ValueError):
        return False


def _changes(printed: Printed, digit: Digit) -> tuple[list[Printed], list[Printed]]:
    """Return printed items with values changed by just over one tolerance, and just over two."""
    text = _text(printed.value, digit.path)
    number = decimal(text)
    if number is None:
        figure = int(text[digit.index])
        steps = [(figure + way) % 10 for way in (1, 2)]
        found = [_with_digit(printed, digit, f"{step}") for step in steps]
        return found, found
    unit = Decimal(1).scaleb(_exponent(text, digit.index))
    room = tolerance(printed, number)
    near, far = (unit * (way // unit + 1) for way in (room, 2 * room))
    return (
        [_with_text(printed, digit.path, f"{number + sign * near}") for sign in (1, -1)],
        [_with_text(printed, digit.path, f"{number + sign * far}") for sign in (1, -1)],
    )


def _exponent(text: str, index: int) -> int:
    """Return the exponent k of the place value 10^k of a digit in a decimal number."""
    point = text.find(".")
    if point < 0:
        return len(text) - 1 - index
    return point - 1 - index if index < point else point - index


def _text(value: Text | None, path: tuple[int, ...]) -> str:
    for k in path:
        value = value[k] if value is not None else None
    if not isinstance(value, str):
        raise TypeError(f"expected a string, got {value}")
    return value


def _with_digit(printed: Printed, digit: Digit, figure: str) -> Printed:
    text = _text(printed.value, digit.path)
    return _with_text(printed, digit.path, text[: digit.index] + figure + text[digit.index + 1 :])


def _with_text(printed: Printed, path: tuple[int, ...], text: str) -> Printed:
    return replace(printed, value=_replaced(printed.value, path, text))


def _replaced(value: Text | None, path: tuple[int, ...], text: str) -> Text:
    if not path:
        return text
    if not isinstance(value, tuple):
        raise TypeError(f"expected rows, got {value}")
    k, *rest = path
    return (*value[:k], _replaced(value[k], tuple(rest), text), *value[k + 1 :])
