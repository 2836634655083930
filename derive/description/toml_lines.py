"""The lines of values in a TOML text, which Python's parser does not keep."""

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


def table_of(text: str) -> dict[str, object]:
    """A TOML text as a table, its decimals exact."""
    return tomllib.loads(text, parse_float=Decimal)


def first_line(text: str, holds: Callable[[str], bool]) -> int:
    """The first line up to which the text, its brackets closed, has a property.

    The parser keeps no positions, so that beginnings of the text are parsed one by one.
    """
    lines = text.split("\n")

    def reached(number: int) -> bool:
        try:
            return holds(_closed("\n".join(lines[:number])))
        except tomllib.TOMLDecodeError:
            return False

    return bisect.bisect_left(range(1, len(lines)), True, key=reached) + 1


def _closed(text: str) -> str:
    """The beginning of a file, its open strings and brackets closed."""
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
    """Whether the parser fails at a number or at brackets, and not at the text's form."""
    try:
        table_of(text)
    except tomllib.TOMLDecodeError:
        raise
    except (ValueError, ArithmeticError, RecursionError):
        return True
    return False
