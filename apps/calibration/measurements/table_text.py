"""Split a text table into cells."""

from __future__ import annotations

import codecs
import csv
import math
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from chasles import InputValueError
from chasles.contract import read_input

COMMENTS = ("#", "%", "//")
_SEPARATORS = (";", "\t", "|", ",")
_ARCHIVE = b"PK\x03\x04"
"""First bytes of a spreadsheet file, which is a ZIP archive."""
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")
_BEFORE_UNIT = re.compile(r"\s+(?![\[(])")
"""Pattern of the spaces that separate columns. Spaces before a bracket do not separate columns, as
in "q1 [deg]"."""
_MAX_COLUMNS = 10_000
_GROUP = 3
"""Number of digits between thousands separators."""


class TableLine(NamedTuple):
    """A line of a table, with its line number in the file and its cells."""

    number: int
    cells: list[str]


class TableText(NamedTuple):
    """The lines of a table file.

    `comment` contains the cells of the last comment line above the table.
    """

    lines: list[TableLine]
    comment: list[str]
    separator: str


def cells_of(path: Path) -> TableText:
    """Return the lines of a table file, split into cells.

    Raises:
        InputValueError: The file cannot be read, is a spreadsheet, or is empty.
    """
    try:
        content = read_input(path)
    except OSError as error:
        raise InputValueError(f"{path}: cannot read the table ({error.strerror})") from None
    comment = ""
    kept: list[tuple[int, str]] = []
    for number, line in enumerate(_decoded(path, content).splitlines(), 1):
        if not line.strip(" \t,;|"):
            continue
        if line.lstrip().startswith(COMMENTS):
            comment = comment if kept else line.lstrip("#%/ \t")
            continue
        kept.append((number, line))
    if not kept:
        raise InputValueError(
            f"{path}: the table is empty; expected a header and a row for each measurement"
        )
    texts = [line for _, line in kept]
    separator = _separator(texts)
    try:
        split = list(_split(texts, separator))
        comment_cells = next(_split([comment], separator), [])
    except csv.Error as error:
        raise InputValueError(f"{path}: cannot read the table ({error})") from None
    lines = [TableLine(number, cells) for (number, _), cells in zip(kept, split, strict=True)]
    for number, cells in lines:
        if len(cells) > _MAX_COLUMNS:
            raise InputValueError(f"{path}, line {number}: more than {_MAX_COLUMNS} cells")
    return TableText(lines, comment_cells, separator)


def _decoded(path: Path, content: bytes) -> str:
    """Decode a file in UTF-8, UTF-16 with a byte order mark, or Windows code page 1252."""
    if content.startswith(_ARCHIVE):
        raise InputValueError(f"{path}: the file is a spreadsheet; save the table as text (CSV)")
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return content.decode("utf-16", errors="replace")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("cp1252", errors="replace")


def _separator(texts: Sequence[str]) -> str:
    """Return the column separator that most lines contain, or "" for spaces.

    Semicolons, tabs and vertical bars are tested before commas, because commas may be decimal
    marks.
    """
    for mark in _SEPARATORS:
        if 2 * sum(mark in text for text in texts) > len(texts):
            words = texts[-1].split()
            by_spaces = mark == "," and len(words) > 1 and all(map(is_number, words))
            return "" if by_spaces else mark
    return ""


def _split(texts: Sequence[str], separator: str) -> Iterator[list[str]]:
    for text in texts:
        if separator:
            # The text is read line by line, so an unclosed quotation mark affects a single line.
            yield next(csv.reader([text], delimiter=separator, skipinitialspace=True), [])
        else:
            yield _BEFORE_UNIT.split(text.strip())


def number(cell: str) -> float:
    """Return the number in a cell, or NaN if the cell contains no number.

    A comma in a number without a point is a decimal mark. If a cell contains a point and a comma,
    the last mark is the decimal mark, and the earlier marks separate thousands.
    """
    text = cell.strip().replace("\u2212", "-")
    if text.endswith(","):
        return math.nan
    point, comma = text.rfind("."), text.rfind(",")
    if min(point, comma) >= 0:
        marks = ",." if point > comma else ".,"
        if any(len(group) != _GROUP for group in _groups(text, *marks)):
            return math.nan
        text = text.replace(marks[0], "").replace(marks[1], ".")
    else:
        text = text.replace(",", ".", 1)
    return float(text) if _NUMBER.fullmatch(text) else math.nan


def _groups(text: str, thousands: str, decimal: str) -> list[str]:
    return text.split(decimal, maxsplit=1)[0].split(thousands)[1:]


def is_number(cell: str) -> bool:
    """Return whether a cell contains a finite number."""
    return math.isfinite(number(cell))
