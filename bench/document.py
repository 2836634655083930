"""Update of docs/performance.md with the results of the last full run."""

import json
from pathlib import Path

from .report import RESULTS, text

PAGE = Path(__file__).parent.parent / "docs" / "performance.md"
BEGIN, END = "<!-- figures: python -m bench -->\n", "<!-- end of figures -->\n"
RATIOS = ("row", "chasles", "compared with", "ns", "ratio", "at least", "target", "")
LIMITS = ("row", "chasles", "unit", "target", "")


def write() -> None:
    """Replace the text of docs/performance.md between its two marker comments."""
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    _, _, after = rest.partition(END)
    PAGE.write_text(before + BEGIN + figures() + END + after, encoding="utf-8")


def figures() -> str:
    """Return the description of the machine and all result tables."""
    results = [
        json.loads(file.read_text(encoding="utf-8")) for file in sorted(RESULTS.glob("*.json"))
    ]
    rows = [row for result in results for row in result.get("found", ())]
    ratios = sorted((row for row in rows if "median" in row), key=lambda row: row["median"])
    limits = [row for row in rows if "unit" in row]
    tables = _block([RATIOS, *map(_ratio, ratios)]) + _block([LIMITS, *map(_limit, limits)])
    return f"{_machine(results[0]['machine'])}\n{tables}"


def _machine(machine: dict[str, str]) -> str:
    first = f"{machine.pop('processor')}; {machine.pop('compiler')}"
    return f"Measured on {first}; {', '.join(f'{n} {v}' for n, v in machine.items())}."


def _block(rows: list[tuple[str, ...]]) -> str:
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = ["  ".join(map(str.ljust, row, widths)).rstrip() for row in rows]
    return "\n".join(["", "```", *lines, "```", ""])


def _ratio(row: dict) -> tuple[str, ...]:
    name, _, peer = row["key"].partition(": ")
    numbers = (text(row[key]) for key in ("peer", "median", "least"))
    return (name, text(row["own"]), _OTHER.get(peer, peer), *numbers, *_bar(row))


def _limit(row: dict) -> tuple[str, ...]:
    return (row["key"], text(row["value"]), row["unit"], *_bar(row))


def _bar(row: dict) -> tuple[str, str]:
    if row["bar"] is None:
        return "", ""
    return text(row["bar"]), "reached" if row["holds"] else "missed"


_OTHER = {"of 6": "a joint of 6", "one": "one thread", "chasles, one sine at a time": "one sine"}
"""Full names that replace shortened names in the table."""
