"""Compares the ratios of a short run with a committed baseline, and reports the slower ones.

Ratios to peers in the same run cancel most of a machine's speed; a margin covers the rest. If a
ratio falls below the margin, all are measured a second time; only a ratio that falls twice counts.
"""

import json
from collections.abc import Mapping
from pathlib import Path

from .plans import SECTIONS, SHORT, without_slow_builds
from .report import Ratio, machine, out, table

BASELINE = Path(__file__).with_name("baseline.json")
MARGIN = 0.4
"""The share of a ratio that may be lost on the machine of the baseline.

It is wide because the code of chasles keeps the arithmetic units busy while its peers wait: another
process on the same core lowers the ratios. Counted instructions find small losses instead.
"""
MARGIN_ELSEWHERE = 0.5
"""The share of a ratio that may be lost on another processor or with another compiler."""


def run(write: bool) -> int:
    """Measures, then writes the baseline or compares with it; returns the exit status."""
    found = measured()
    if write:
        content = {"machine": machine(), "ratios": found}
        BASELINE.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
        return 0
    baseline = json.loads(BASELINE.read_text(encoding="utf-8"))
    margin = margin_between(baseline["machine"], machine())
    expected: dict[str, float] = baseline["ratios"]
    if slower(expected, found, margin):
        again = measured()
        found = {key: max(value, again.get(key, value)) for key, value in found.items()}
    fallen = slower(expected, found, margin)
    show(expected, found, margin)
    for key in fallen:
        out.print(f"slower: {key}: {found[key]:.2f}, was {expected[key]:.2f}")
    return 1 if fallen else 0


def measured() -> dict[str, float]:
    """The ratios of a short run, each between the least times."""
    plan = without_slow_builds(SHORT)
    rows = [row for _, section in SECTIONS.values() for row in section(plan)]
    return {row.key: round(row.of_best, 3) for row in rows if isinstance(row, Ratio)}


def margin_between(baseline: Mapping[str, str], here: Mapping[str, str]) -> float:
    """The margin for ratios of the baseline's machine compared with ratios of this machine."""
    alike = all(baseline[name] == here[name] for name in ("processor", "compiler"))
    return MARGIN if alike else MARGIN_ELSEWHERE


def slower(expected: Mapping[str, float], found: Mapping[str, float], margin: float) -> list[str]:
    """Keys of the measured ratios that fell by more than the margin."""
    return [key for key in expected if key in found and found[key] < expected[key] * (1 - margin)]


def show(expected: Mapping[str, float], found: Mapping[str, float], margin: float) -> None:
    """Prints all ratios next to the ratios of the baseline."""
    rows = [
        (key, expected.get(key, "new"), found.get(key, "not measured"))
        for key in {**expected, **found}
    ]
    table(f"Ratios; {margin:.0%} may be lost", ("ratio to a peer", "baseline", "now"), rows)
