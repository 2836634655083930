"""Comparison of the time ratios of a short run with a committed baseline.

A time ratio is the time of another library divided by the time of chasles, measured in the same
run. Time ratios vary slightly between machines, so the check tolerates a small decrease. If a time
ratio decreases by more than the allowed margin, all time ratios are measured again. The check fails
if the decrease exceeds the margin in both measurements.
"""

import json
from collections.abc import Mapping
from pathlib import Path

from .plans import SECTIONS, SHORT, without_slow_builds
from .report import Ratio, machine, out, table

BASELINE = Path(__file__).with_name("baseline.json")
MARGIN = 0.4
"""Permitted relative decrease of a time ratio compared with a baseline from this machine.

Other processes on the same core reduce the speed of chasles more than of other libraries.
Instruction counts (`count.py`) detect small slowdowns.
"""
MARGIN_ELSEWHERE = 0.5
"""Allowed relative decrease of a time ratio if the processor or the compiler differs from the
baseline."""


def run(write: bool) -> int:
    """Measure time ratios, and write or check the baseline."""
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
    """Return the time ratio of each compared pair of programs, by name.

    The time of a program is the minimum over the repetitions of a short run.
    """
    plan = without_slow_builds(SHORT)
    rows = [row for _, section in SECTIONS.values() for row in section(plan)]
    return {row.key: round(row.of_best, 3) for row in rows if isinstance(row, Ratio)}


def margin_between(baseline: Mapping[str, str], here: Mapping[str, str]) -> float:
    """Return the allowed relative decrease of a time ratio.

    The margin is larger if the processor or compiler differs from the baseline.
    """
    alike = all(baseline[name] == here[name] for name in ("processor", "compiler"))
    return MARGIN if alike else MARGIN_ELSEWHERE


def slower(expected: Mapping[str, float], found: Mapping[str, float], margin: float) -> list[str]:
    return [key for key in expected if key in found and found[key] < expected[key] * (1 - margin)]


def show(expected: Mapping[str, float], found: Mapping[str, float], margin: float) -> None:
    rows = [
        (key, expected.get(key, "new"), found.get(key, "not measured"))
        for key in {**expected, **found}
    ]
    table(f"Ratios; allowed decrease {margin:.0%}", ("ratio to a peer", "baseline", "now"), rows)
