"""Finds the lines of values in a TOML text. Python's TOML parser stores no positions."""

import bisect
import re
import tomllib
from collections.abc import Callable
from decimal import Decimal

_BRACKETS = {"[": "]", "{": "}"}
_TOKEN = re.compile(
    r"""
    \#[^\n]*                                  # a comment
    | \"{3}(?:\\.|[^\\])*?(?:\"{3,5}|\Z)       # strings of several lines, perhaps unfinished
    | '{3}.*?(?:'{3,5}|\Z)
    | "(?:\\.|[^"\\\n])*" | '[^'\n]*'        # strings of one line
    | [][{}]
    """,
    re.DOTALL | re.VERBOSE,
)
MAX_PARTS = 20
"""Maximum number of parts in a dotted key.

The number is limited because the parser copies every prefix of a dotted key.
"""
_LONG_KEY = re.compile(
    rf"""(?<![\w-])(?:(?:[\w-]+|"[^"\n]*"|'[^'\n]*')[ \t]*\.[ \t]*){{{MAX_PARTS}}}"""
)


class LongKeyError(ValueError):
    """A dotted key has more than `MAX_PARTS` parts."""


def table_of(text: str) -> dict[str, object]:
    """Parse a TOML text. Decimals are exact.

    Raises:
        TOMLDecodeError: The text is not TOML.
        LongKeyError: A key has too many parts. ValueError, ArithmeticError: A number has too many
            digits.
        RecursionError: Brackets are nested too deeply.
    """
    if _LONG_KEY.search(text):
        raise LongKeyError
    return tomllib.loads(text, parse_float=Decimal)


def first_line(text: str, holds: Callable[[str], bool]) -> int:
    """Return the first line such that the text up to this line fulfills ``holds``.

    Bisection finds the line number.
    """
    lines = text.split("\n")

    def reached(number: int) -> bool:
        try:
            return holds(_closed("\n".join(lines[:number])))
        except tomllib.TOMLDecodeError:
            return False

    return bisect.bisect_left(range(1, len(lines)), True, key=reached) + 1


def _closed(text: str) -> str:
    """Close all open strings and brackets of a truncated text."""
    open_brackets: list[str] = []
    string = ""
    for match in _TOKEN.finditer(text):
        token = match.group()
        quotes = token[:3]
        if token in _BRACKETS:
            open_brackets.append(_BRACKETS[token])
        elif token in ("]", "}"):
            del open_brackets[-1:]
        elif quotes in ('"""', "'''") and not (len(token) > 5 and token.endswith(quotes)):  # noqa: PLR2004
            string = quotes
    return f"{text}\n{string}{''.join(reversed(open_brackets))}"


def is_unreadable(text: str) -> bool:
    """Whether parsing fails despite valid syntax, for example because of deeply nested brackets."""
    try:
        table_of(text)
    except tomllib.TOMLDecodeError:
        raise
    except (ValueError, ArithmeticError, RecursionError):
        return True
    return False
