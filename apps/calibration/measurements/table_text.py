"""The cells of a table as programs write it: encoding, separators, comments, decimal marks."""

from __future__ import annotations

import codecs
import csv
import math
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from chasles import InputValueError

COMMENTS = ("#", "%", "//")
_SEPARATORS = (";", "\t", "|", ",")
_ARCHIVE = b"PK\x03\x04"
"""The first bytes of spreadsheets, which are archives."""
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")
_BEFORE_UNIT = re.compile(r"\s+(?![\[(])")
"""Spaces that separate columns; one before a bracket belongs to a unit."""
_GROUP = 3
"""Digits between the marks of thousands."""


class TableLine(NamedTuple):
    """A line of a table: its number in the file, from 1, and its cells."""

    number: int
    cells: list[str]


class TableText(NamedTuple):
    """A table's lines without comments, and the comment before the first of them, in cells."""

    lines: list[TableLine]
    comment: list[str]
    separator: str


def cells_of(path: Path) -> TableText:
    """The cells of a file.

    Raises:
        InputValueError: The file is a spreadsheet, or empty.
    """
    comment = ""
    kept: list[tuple[int, str]] = []
    for number, line in enumerate(_decoded(path, path.read_bytes()).splitlines(), 1):
        if not line.strip(" \t,;|"):
            continue
        if line.lstrip().startswith(COMMENTS):
            comment = comment if kept else line.lstrip("#%/ \t")
            continue
        kept.append((number, line))
    if not kept:
        raise InputValueError(f"{path}: empty; expected a header and a row for each measurement")
    texts = [line for _, line in kept]
    separator = _separator(texts)
    split = list(_split(texts, separator))
    lines = [TableLine(number, cells) for (number, _), cells in zip(kept, split, strict=True)]
    return TableText(lines, next(_split([comment], separator), []), separator)


def _decoded(path: Path, content: bytes) -> str:
    """Text in UTF-8, or as Windows programs write it: UTF-16 with a mark, or code page 1252."""
    if content.startswith(_ARCHIVE):
        raise InputValueError(f"{path}: a spreadsheet; save it as text (CSV)")
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return content.decode("utf-16")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("cp1252", errors="replace")


def _separator(texts: Sequence[str]) -> str:
    """The mark that most lines contain; "" for spaces.

    A semicolon, a tab or a bar goes before a comma, which may be a decimal mark.
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
            # Line by line: a quotation mark that nobody closes must not take the next line along.
            yield next(csv.reader([text], delimiter=separator, skipinitialspace=True), [])
        else:
            yield _BEFORE_UNIT.split(text.strip())


def number(cell: str) -> float:
    """The number in a cell; NaN where there is none.

    A comma is a decimal mark. Of a point and a comma the one behind is, where the other separates
    thousands.
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
    """The digits behind each mark of thousands."""
    return text.split(decimal, maxsplit=1)[0].split(thousands)[1:]


def is_number(cell: str) -> bool:
    """Whether a cell holds a finite number."""
    return math.isfinite(number(cell))
