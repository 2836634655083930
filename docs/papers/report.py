"""Papers beside chasles: each printed number next to ours, with a verdict that is asserted.

Each script of this folder has two functions. `rows()` returns a list of `Row`, `figures()` a dict
from the caption of a figure to the matplotlib figure, or to a function that writes an animation to
the GIF that it is given. The numbers of a paper stand in `printed/<paper>.toml`, a table an item:

    [theta_of_row_5]
    item = "angle of row 5"         # name in the tables; default: the key
    value = "0.97"                  # a string, so that its digits count; a list of strings, nested
                                    # too; a string that is no number; left out where it is lost
    unit = "rad"                    # a unit of UNITS; default: none
    where = "table 4, row 5"
    digits = 4                      # decimals of ours; default: one more than printed, and more
                                    # where ours would stand just at the edge of agreement
    about = "0.1"                   # the paper's "about" as a tolerance in the unit
    text = "an angle of about 1"    # the paper's words, "about" among them; obligatory with it

    $ python docs/papers/photo_robot.py       # the table of one paper
    $ python docs/papers/report.py            # all tables and pictures in build/reproduce
    $ python docs/papers/report.py --write    # the same, and docs/papers.md anew
"""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal, InvalidOperation
from math import acos, atan2, cos, pi, sin, sqrt
from pathlib import Path
from typing import Any, Literal

import numpy as np

Verdict = Literal["agrees", "erratum", "assumed", "lost", "not reproducible"]
Value = Any
"""A number, an array, or words; numbers in metres, radians and seconds."""
Text = str | tuple["Text", ...]
"""A printed value: the string of a number or word, or rows of them."""

PRINTED = Path(__file__).parent / "printed"
UNITS = {
    "": 1.0,
    "m": 1.0,
    "cm": 1e-2,
    "mm": 1e-3,
    "in": 0.0254,
    "mm²": 1e-6,
    "m²": 1.0,
    "m³": 1.0,
    "rad": 1.0,
    "deg": pi / 180,
    "%": 1e-2,
    "s": 1.0,
    "m/s": 1.0,
    "mm/s": 1e-3,
    "in/s": 0.0254,
    "mm·deg/s": 1e-3 * pi / 180,
    "rad/s": 1.0,
    "deg/s": pi / 180,
    "rad/s²": 1.0,
    "deg/s²": pi / 180,
    "mm/s²": 1e-3,
}
"""What a printed unit is in metres, radians and seconds."""
ROUNDING = 1e-9
"""Part of a value that the arithmetic of a comparison may lose; a printed 0.65 stands for numbers
up to 0.655, which no float is exactly."""
_MOST_DECIMALS = 12
_MOST_SHOWN = 6
"""Entries of equations whose values the tables show."""
_FUNCTIONS = {"pi": pi, "cos": cos, "sin": sin, "atan2": atan2, "acos": acos, "sqrt": sqrt}


class Refuted(AssertionError):
    """A verdict that the numbers do not bear out."""


@dataclass(frozen=True)
class Printed:
    """An item as a paper prints it.

    Attributes:
        item: Its name.
        value: The number or the words as printed, or rows of them; None: not printed, or lost.
        unit: Its unit, one of `UNITS`.
        where: Where it stands in the paper.
        about: The tolerance [unit] that the paper's words leave; None: half a unit of the last
            printed digit.
        text: The paper's words.
        digits: Decimals to which ours is shown; None: one more than printed.
    """

    item: str
    value: Text | None
    unit: str
    where: str
    about: str | None = None
    text: str = ""
    digits: int | None = None


@dataclass(frozen=True)
class Row:
    """A line of a paper's table.

    Attributes:
        item: Its name.
        printed: The value as printed [unit]; None: not printed, or lost.
        ours: The value by chasles [unit]; None where there is none.
        unit: The unit of both.
        verdict: What comparing them gave.
        where: Where the item stands in the paper.
        note: The corrected value, the paper's "about", what was tried or assumed.
        digits: Decimals to which `ours` is shown where it is a number.
    """

    item: str
    printed: float | str | None
    ours: float | str | None
    unit: str
    verdict: Verdict
    where: str
    note: str = ""
    digits: int = 6

    @property
    def shown(self) -> tuple[str, str]:
        """The printed value and ours as the tables show them."""
        printed = _number(self.printed, self.digits) if self.printed is not None else "-"
        return printed, _number(self.ours, self.digits) if self.ours is not None else "-"


def read(paper: str) -> dict[str, Printed]:
    """What a paper prints, by key.

    Args:
        paper: The name of the file in `printed/`, without its ending.

    Raises:
        ValueError: A unit is unknown, or an "about" lacks the paper's words.
    """
    tables = tomllib.loads((PRINTED / f"{paper}.toml").read_text(encoding="utf-8"))
    return {key: _printed(f"{paper}.toml, {key}", key, table) for key, table in tables.items()}


def _printed(place: str, key: str, table: dict[str, Any]) -> Printed:
    unit, about = table.get("unit", ""), table.get("about")
    if unit not in UNITS:
        raise ValueError(f"{place}: expected a unit of {', '.join(UNITS)}, got {unit}")
    if about is not None and "about" not in table.get("text", ""):
        raise ValueError(f"{place}: about = {about} stands without the paper's words in text")
    value = _frozen(table["value"]) if "value" in table else None
    item = table.get("item", key.replace("_", " "))
    text, digits = table.get("text", ""), table.get("digits")
    return Printed(item, value, unit, table["where"], about, text, digits)


def _frozen(value: Any) -> Text:
    return tuple(map(_frozen, value)) if isinstance(value, list) else str(value)


def evaluated(printed: Printed, **values: float) -> Any:
    """What printed equations give, in the shape in which they are printed.

    Args:
        printed: The item; its value is an equation in Python's notation, or rows of them.
        values: The symbols in them, in metres and radians; cos, sin and the like are known.

    Returns:
        A number or an array. An item without numbers left in it evaluates to its numbers.
    """

    def value(text: Text | None) -> Any:
        if isinstance(text, tuple):
            return [value(part) for part in text]
        return eval(str(text), {"__builtins__": {}}, {**_FUNCTIONS, **values})

    found = value(printed.value)
    return np.array(found) if isinstance(found, list) else found


def agrees(printed: Printed, ours: Value, note: str = "", *, evaluated: Value = None) -> Row:
    """The value agrees with the printed one to half a unit of its last digit, or to its "about".

    Args:
        printed: The item; its value is a number, words or rows of them.
        ours: The value by chasles in metres, radians and seconds, shaped like the printed one.
        note: What a reader should know.
        evaluated: What the printed equations give, where the item is one: then ours is the same to
            rounding.

    Raises:
        Refuted: It does not agree.
    """
    if printed.value is None:
        raise Refuted(f"{printed.item}: nothing is printed that could agree")
    if not _same(printed.value if evaluated is None else evaluated, ours, printed):
        raise _refuted(printed, ours, "does not agree with")
    if np.size(evaluated) > _MOST_SHOWN:
        equations = f"{np.size(evaluated)} entries"
        return Row(printed.item, equations, "the same", "", "agrees", printed.where, note)
    if printed.about is not None:
        note = "; ".join(filter(None, (f"“{printed.text}”: ± {printed.about}", note)))
    return _with_value(_row(printed, ours, "agrees", note), printed, evaluated)


def erratum(
    printed: Printed, ours: Value, corrected: Value, note: str = "", *, evaluated: Value = None
) -> Row:
    """The printed value is wrong, and a corrected one right.

    Args:
        printed: The item.
        ours: The value by chasles in metres, radians and seconds.
        corrected: The value that should be printed: a string in the item's unit, to half a unit of
            its last digit; or a number or array in metres, radians and seconds that follows from a
            corrected equation, to rounding.
        note: What is wrong.
        evaluated: What the printed equation gives, where the item is an equation, as `ours`.

    Raises:
        Refuted: The printed value agrees with ours, or the corrected one does not.
    """
    wrong = printed.value if evaluated is None else evaluated
    if wrong is None or _same(wrong, ours, printed):
        raise _refuted(printed, ours, "is no erratum beside")
    if not _same(corrected, ours, replace(printed, about=None)):
        raise _refuted(printed, ours, f"corrected to {corrected} does not agree with")
    right = corrected if isinstance(corrected, str) else ""
    note = "; ".join(filter(None, (f"read {right} {printed.unit}".strip() if right else "", note)))
    return _with_value(_row(printed, ours, "erratum", note), printed, evaluated)


def _with_value(row: Row, printed: Printed, evaluated: Value) -> Row:
    """The row of an equation, with its value behind it."""
    if evaluated is None:
        return row
    value = _number(_shown(evaluated, printed, row.digits), row.digits)
    return replace(row, printed=f"{row.printed} = {value}" if row.printed else value)


def assumed(printed: Printed, ours: Value, reason: str) -> Row:
    """A value that the paper needs and does not print: the one that we chose, and why.

    Raises:
        Refuted: The paper prints a value, or the reason is empty.
    """
    return _without_value(printed, ours, "assumed", reason)


def lost(printed: Printed, ours: Value, reason: str) -> Row:
    """A value or a curve that the text of the paper no longer has, with ours in its place.

    Raises:
        Refuted: The paper prints a value, or the reason is empty.
    """
    return _without_value(printed, ours, "lost", reason)


def _without_value(printed: Printed, ours: Value, verdict: Verdict, reason: str) -> Row:
    if printed.value is not None or not reason:
        raise Refuted(f"{printed.item}: {printed.value} is printed, or no reason is given")
    return _row(printed, ours, verdict, reason)


def not_reproducible(printed: Printed, ours: Value, tried: str) -> Row:
    """The printed value does not follow from what the paper states.

    Args:
        printed: The item.
        ours: The value by chasles in metres, radians and seconds.
        tried: The readings that were tried.

    Raises:
        Refuted: The value agrees after all, or nothing was tried.
    """
    if printed.value is None or not tried or _same(printed.value, ours, printed):
        raise _refuted(printed, ours, "is reproducible by")
    return _row(printed, ours, "not reproducible", tried)


def _same(value: Value, ours: Value, printed: Printed) -> bool:
    """Whether ours is a printed value (texts in its unit), or a computed one (to rounding)."""
    if isinstance(value, tuple):
        return len(value) == len(ours) and all(
            _same(part, own, printed) for part, own in zip(value, ours, strict=True)
        )
    if isinstance(value, str):
        number = _decimal(value)
        if number is None or isinstance(ours, str):
            return value == ours
        factor = UNITS[printed.unit]
        half = float(printed.about) if printed.about is not None else _half_unit(number)
        room = half + ROUNDING * max(half, abs(float(number)))
        return bool(abs(float(ours) / factor - float(number)) <= room)
    size = max(1.0, float(np.max(np.abs(ours))))
    return np.shape(value) == np.shape(ours) and bool(
        np.max(np.abs(np.asarray(value) - np.asarray(ours))) <= ROUNDING * size
    )


def _decimal(value: str) -> Decimal | None:
    try:
        return Decimal(value.replace(",", ""))
    except InvalidOperation:
        return None


def _half_unit(number: Decimal) -> float:
    return float(_half(number))


def _half(number: Decimal) -> Decimal:
    """Half a unit of the last digit."""
    return Decimal(5).scaleb(int(number.as_tuple().exponent) - 1)


def _row(printed: Printed, ours: Value, verdict: Verdict, note: str) -> Row:
    digits = printed.digits
    if digits is None:
        digits = min(_decimals(printed.value) + 1, _MOST_DECIMALS)
    while digits < _MOST_DECIMALS and _at_the_edge(printed.value, ours, printed, digits):
        digits += 1
    own = None if ours is None else _shown(ours, printed, digits)
    value = None if printed.value is None else _texts(printed.value)
    return Row(printed.item, value, own, printed.unit, verdict, printed.where, note, digits)


def _at_the_edge(value: Text | None, ours: Value, printed: Printed, digits: int) -> bool:
    """Whether a number, rounded for the table, stands just at the edge of agreement and is not it.

    There a reader cannot see on which side it is.
    """
    if isinstance(value, tuple) and np.ndim(ours) and len(value) == len(ours):
        pairs = zip(value, ours, strict=True)
        return any(_at_the_edge(part, own, printed, digits) for part, own in pairs)
    number = _decimal(value) if isinstance(value, str) else None
    if number is None or isinstance(ours, str) or np.ndim(ours):
        return False
    own = float(ours) / UNITS[printed.unit]
    if not np.isfinite(own):
        return False
    shown = Decimal(f"{own:.{digits}f}")
    half = Decimal(printed.about) if printed.about is not None else _half(number)
    exactly = abs(float(shown) - own) <= ROUNDING * max(1.0, abs(own))
    return abs(shown - number) == half and not exactly


def _decimals(value: Text | None) -> int:
    """Decimals of the printed number with the most; 3 where none is printed, 5 of equations."""
    if value is None:
        return 3
    if isinstance(value, tuple):
        return max(map(_decimals, value), default=0)
    number = _decimal(value)
    return 5 if number is None else max(0, -int(number.as_tuple().exponent))


def _shown(ours: Value, printed: Printed, digits: int) -> float | str:
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


def _texts(value: Text) -> str:
    return value if isinstance(value, str) else f"({', '.join(map(_texts, value))})"


def _number(value: float | str, digits: int) -> str:
    """A number with its decimals; never a negative zero."""
    if isinstance(value, str):
        return value
    shown = f"{value:.{digits}f}"
    return shown.removeprefix("-") if float(shown) == 0 else shown


def _refuted(printed: Printed, ours: Value, words: str) -> Refuted:
    return Refuted(
        f"{printed.item} ({printed.where}): printed {printed.value} {printed.unit} {words} "
        f"{_shown(ours, printed, _MOST_DECIMALS)} {printed.unit}"
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
