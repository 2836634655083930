"""Update of docs/performance.md with the results of the last full run."""

import json
from pathlib import Path

from .report import RESULTS, text

PAGE = Path(__file__).parent.parent / "docs" / "performance.md"
BEGIN, END = "<!-- figures: python -m bench -->\n", "<!-- end of figures -->\n"
HEAD = """\
| row | chasles | compared with | ratio | bar |
|---|---|---|---|---|
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
    name, _, peer = row["key"].partition(": ")
    times = f"chasles: {text(row['own'])} ns | {_OTHER.get(peer, peer)}: {text(row['peer'])} ns"
    ratio = f"ratio {text(row['median'])}, at least {text(row['least'])}"
    return f"| `{name}` | {times} | {ratio} | {_bar(row, text(row['bar']))} |\n"


def _limit(row: dict) -> str:
    value = f"chasles: {text(row['value'])} {row['unit']}"
    bar = _bar(row, f"{row['bar']} {row['unit']}")
    return f"| `{row['key']}` | {value} | | | {bar} |\n"


def _bar(row: dict, bar: str) -> str:
    if row["bar"] is None:
        return ""
    return f"bar {bar}, {'reached' if row['holds'] else '**missed**'}"


_OTHER = {"of 6": "a joint of 6", "one": "one thread", "chasles, one sine at a time": "one sine"}
"""Names in the table that replace incomplete names of compared measurements."""
