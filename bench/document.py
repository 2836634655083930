"""Update of docs/performance.md with the results of the last full run."""

import json
from pathlib import Path

from .report import RESULTS, text

PAGE = Path(__file__).parent.parent / "docs" / "performance.md"
BEGIN, END = "<!-- figures: python -m bench -->\n", "<!-- end of figures -->\n"
HEAD = """\
| row: compared with | chasles | other | ratio | smallest | bar | |
|---|--:|--:|--:|--:|--:|---|
"""


def write() -> None:
    """Replace the text of docs/performance.md between its two marker comments."""
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    _, _, after = rest.partition(END)
    PAGE.write_text(before + BEGIN + figures() + END + after, encoding="utf-8")


def figures() -> str:
    """Return the machine, and a table of all results, the smallest ratios first."""
    results = [
        json.loads(file.read_text(encoding="utf-8")) for file in sorted(RESULTS.glob("*.json"))
    ]
    rows = [row for result in results for row in result.get("found", ())]
    ratios = sorted((row for row in rows if "median" in row), key=lambda row: row["median"])
    limits = [row for row in rows if "unit" in row]
    lines = [*map(_ratio, ratios), *map(_limit, limits)]
    return f"{_machine(results[0]['machine'])}\n\n{HEAD}{''.join(lines)}"


def _machine(machine: dict[str, str]) -> str:
    first = f"{machine.pop('processor')}; {machine.pop('compiler')}"
    return f"Measured on {first}; {', '.join(f'{n} {v}' for n, v in machine.items())}."


def _ratio(row: dict) -> str:
    times = f"{text(row['own'])} ns | {text(row['peer'])} ns"
    ratio = f"{text(row['median'])} | {text(row['least'])} | {text(row['bar'])}"
    return f"| {row['key']} | {times} | {ratio} | {_mark(row)} |\n"


def _limit(row: dict) -> str:
    value = f"{text(row['value'])} {row['unit']}"
    bar = "" if row["bar"] is None else f"{row['bar']} {row['unit']}"
    return f"| {row['key']} | {value} | | | | {bar} | {_mark(row)} |\n"


def _mark(row: dict) -> str:
    return "" if row["bar"] is None else "holds" if row["holds"] else "**missed**"
