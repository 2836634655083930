"""What a paper prints: its items with their digits, units and words, and its equations evaluated.

The items of a paper stand in `printed/<paper>.toml`, a table an item:

    [theta_of_row_5]
    item = "angle of row 5"         # name in the tables; default: the key
    value = "0.97"                  # copied from the paper: a string, so that its digits count; a
                                    # list of strings, nested too; words or an equation; left out
                                    # where the paper prints nothing, or where it is lost
    evaluated = "0.7854"            # in place of value: a number that the paper does not print,
                                    # evaluated from its equations independently of chasles
    unit = "rad"                    # a unit of UNITS; default: none
    where = "table 4, row 5"
    digits = 4                      # decimals of ours; default: one more than printed, and more
                                    # where ours would stand just at the edge of agreement
    about = "0.1"                   # the paper's "about" as a tolerance in the unit
    text = "an angle of about 1"    # the paper's words, "about" among them; obligatory with it
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from math import acos, atan2, cos, pi, sin, sqrt
from pathlib import Path
from typing import Any

import numpy as np

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
_FUNCTIONS = {"pi": pi, "cos": cos, "sin": sin, "atan2": atan2, "acos": acos, "sqrt": sqrt}


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
        is_evaluated: Whether the paper does not print the value: it was evaluated independently.
    """

    item: str
    value: Text | None
    unit: str
    where: str
    about: str | None = None
    text: str = ""
    digits: int | None = None
    is_evaluated: bool = False


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
    if "value" in table and "evaluated" in table:
        raise ValueError(f"{place}: expected value or evaluated, got both")
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
    )


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


def at(**values: float) -> Callable[[Printed], Any]:
    """A function that evaluates the equations of an item at these values of their symbols."""
    return lambda printed: evaluated(printed, **values)


def decimal(value: str) -> Decimal | None:
    """The number that a text is; None for words and equations."""
    try:
        return Decimal(value.replace(",", ""))
    except InvalidOperation:
        return None


def half_unit(number: Decimal) -> Decimal:
    """Half a unit of the last digit."""
    return Decimal(5).scaleb(int(number.as_tuple().exponent) - 1)


def tolerance(printed: Printed, number: Decimal) -> Decimal:
    """How far from a printed number [unit] ours may lie."""
    return half_unit(number) if printed.about is None else Decimal(printed.about)


def texts(value: Text) -> str:
    """A printed value in one line."""
    return value if isinstance(value, str) else f"({', '.join(map(texts, value))})"
