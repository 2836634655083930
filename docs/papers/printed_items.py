"""Reads the numbers and statements that a paper prints, and evaluates its equations.

The items of a paper are in `printed/<paper>.toml`, one TOML table per item, with these fields:

`item` is the name of the item in the tables, by default the key of the TOML table.

`value` is the value in the paper, as a string such as "0.97" that preserves the printed digits. The
string in `value` can also contain words or an equation. A nested list of strings in `value`
represents a matrix. The field `value` is omitted if the paper prints no value, or if the value is
lost. `lost = true` states that our copy of the paper lacks the value.

If the paper does not print a number, the field `evaluated` replaces `value`. The number in
`evaluated` is computed by the equations of the paper, independently of chasles.

`unit` is the unit of the value, one of `UNITS`; the default is no unit.

`where` is the place of the item in the paper, such as "table 4, row 5".

`digits` is the number of decimals with which the value of chasles is printed. The default of
`digits` is one decimal more than in the paper, or more if rounding would hide whether the values
agree.

`about` is the tolerance, in the item's unit, of a number that follows the word "about" in the
paper.

`text` is the sentence of the paper that contains "about".

"""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from math import acos, atan, atan2, cos, pi, sin, sqrt
from pathlib import Path
from typing import Any

import numpy as np

Value = Any
"""A compared value: a number, an array or a text, with numbers in meters, radians and seconds."""
Text = str | tuple["Text", ...]
"""A printed value: a number or word as a string, or nested tuples of such strings."""

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
"""Factors from printed units to meters, radians and seconds."""
_FUNCTIONS = {
    "pi": pi,
    "cos": cos,
    "sin": sin,
    "atan": atan,
    "atan2": atan2,
    "acos": acos,
    "sqrt": sqrt,
}


@dataclass(frozen=True)
class Printed:
    """A named value that a paper prints.

    Attributes:
        item: Name of the item.
        value: Printed number, word or table, or None if the paper prints no value or if our copy
            lacks the value.
        unit: Unit of the printed value, one of `UNITS`.
        where: The place of the value in the paper, such as a table cell.
        about: Tolerance of the printed number [unit], which the paper's words imply. If `about` is
            None, the tolerance is half a unit of the last printed digit.
        text: The paper's words.
        digits: Number of decimals of our value in the table. If `digits` is None, our value has one
            decimal more than the paper's value.
        is_evaluated: Whether the value was computed independently, because the paper does not print
            the value.
        is_lost: Whether our copy of the paper lacks the value.
        printed_unit: The unit that the paper prints, if we read the value in another unit.
    """

    item: str
    value: Text | None
    unit: str
    where: str
    about: str | None = None
    text: str = ""
    digits: int | None = None
    is_evaluated: bool = False
    is_lost: bool = False
    printed_unit: str = ""


def read(paper: str) -> dict[str, Printed]:
    """Read the printed items of a paper, keyed by the name of their TOML table.

    Args:
        paper: Name of the file in `printed/`, without its suffix.

    Raises:
        ValueError: A unit is unknown, or an item with the field `about` has no field `text`.
    """
    tables = tomllib.loads((PRINTED / f"{paper}.toml").read_text(encoding="utf-8"))
    return {key: _printed(f"{paper}.toml, {key}", key, table) for key, table in tables.items()}


def _printed(place: str, key: str, table: dict[str, Any]) -> Printed:
    unit, about = table.get("unit", ""), table.get("about")
    if unit not in UNITS:
        raise ValueError(f"{place}: expected one of {', '.join(UNITS)}; got the unit {unit}")
    if about is not None and "about" not in table.get("text", ""):
        raise ValueError(f"{place}: field `text` must quote the paper's words for about = {about}")
    if "value" in table and "evaluated" in table:
        raise ValueError(f"{place}: has the fields `value` and `evaluated`; expected one of them")
    found = table.get("value", table.get("evaluated"))
    return Printed(
        item=table.get("item", key.replace("_", " ")),
        value=None if found is None else _frozen(found),
        unit=unit,
        where=table["where"],
        about=about,
        text=table.get("text", ""),
        digits=table.get("digits"),
        is_evaluated="evaluated" in table,
        is_lost=table.get("lost", False),
    )


def unit_word(unit: str) -> str:
    """Return a unit for a sentence: "inch" replaces "in", which would read as a preposition."""
    return "inch" if unit == "in" else unit


def _frozen(value: Any) -> Text:
    return tuple(map(_frozen, value)) if isinstance(value, list) else str(value)


def evaluated(printed: Printed, **values: float) -> Any:
    """Evaluate printed equations, and return their values in the printed shape.

    Args:
        printed: An item of a paper with an equation, or rows of equations, in Python notation.
        values: Values of the equation symbols in meters and radians. Functions such as cos and sin
            are predefined.

    Returns:
        A value of an equation: a number or an array.
    """

    def value(text: Text | None) -> Any:
        if isinstance(text, tuple):
            return [value(part) for part in text]
        return eval(str(text), {"__builtins__": {}}, {**_FUNCTIONS, **values})

    found = value(printed.value)
    return np.array(found) if isinstance(found, list) else found


def at(**values: float) -> Callable[[Printed], Any]:
    """Return a function that evaluates printed equations.

    The keyword arguments are the values of the symbols.
    """
    return lambda printed: evaluated(printed, **values)


def decimal(value: str) -> Decimal | None:
    """Convert a text to a number, or return None for words and equations."""
    try:
        return Decimal(value.replace(",", ""))
    except InvalidOperation:
        return None


def half_unit(number: Decimal) -> Decimal:
    """Return half a unit of the last digit of a decimal number."""
    return Decimal(5).scaleb(int(number.as_tuple().exponent) - 1)


def tolerance(printed: Printed, number: Decimal) -> Decimal:
    """Return the allowed difference between our value and a printed number [unit]."""
    return half_unit(number) if printed.about is None else Decimal(printed.about)


def texts(value: Text) -> str:
    """Format a printed value in one line."""
    return value if isinstance(value, str) else f"({', '.join(map(texts, value))})"
