"""Fixed costs: batches of size one and zero, attribute lookup, import and load."""

import subprocess
import sys
from collections.abc import Callable

import numpy as np

import chasles

from ..report import Limit, Plan, Ratio, alternated, ratio

BATCH_OF_ONE = 1 / 1.5
"""A batch of one pose may take at most 1.5 times the time of a single call."""
LOOK_UP = 1 / 1.5
"""Minimum ratio of attribute lookup times: the time on a plain object divided by the time on a
robot."""
IMPORT_MS, LOAD_MS = 100, 20


def run(plan: Plan) -> list[Ratio | Limit]:
    """Compare the fixed costs of small batches, attribute lookups, import and load."""
    return [*batches(plan), *look_up(plan), *startup(plan)]


def batches(plan: Plan) -> list[Ratio | Limit]:
    """Compare a batch of one pose with a single call, and try an empty batch."""
    fk = chasles.load("ur5e").fk
    single = np.random.default_rng(0).uniform(-np.pi, np.pi, 6)
    shapes = {"single": single, "one": single[None], "none": np.empty((0, 6))}
    assert fk(shapes["none"]).shape == (0, 4, 4)
    works = {name: _repeated(fk, q, plan.calls) for name, q in shapes.items()}
    times = alternated(works, plan.rounds)
    bars = {"one": BATCH_OF_ONE, "none": None}
    return [
        ratio(f"batch of {name}: single call", times, (name, "single"), plan.calls, bar)
        for name, bar in bars.items()
    ]


def _repeated(work: Callable[[np.ndarray], object], q: np.ndarray, count: int):
    def repeat() -> None:
        for _ in range(count):
            work(q)

    return repeat


class _Plain:
    """A Python object with one attribute, to compare the time of an attribute lookup."""


def look_up(plan: Plan) -> list[Ratio]:
    """Compare the times of attribute lookups on a robot and on a plain object."""
    arm, plain = chasles.load("ur5e"), _Plain()
    plain.fk = arm.fk
    times = alternated(
        {"robot": _looked_up(arm, plan), "plain": _looked_up(plain, plan)}, plan.rounds
    )
    return [ratio("arm.fk: plain object", times, ("robot", "plain"), plan.calls, LOOK_UP)]


def _looked_up(item, plan: Plan):
    def repeat() -> None:
        for _ in range(plan.calls):
            item.fk  # noqa: B018

    return repeat


def startup(plan: Plan) -> list[Limit]:
    """Measure the import time of chasles after NumPy, and the load time of a cached robot."""
    chasles.load("ur5e")
    importing = _measured("import numpy", "import chasles", plan.rounds)
    loading = _measured("import chasles", "chasles.load('ur5e')", plan.rounds)
    return [
        Limit("import chasles beyond NumPy", importing * 1e3, "ms", IMPORT_MS),
        Limit("load ur5e from the cache", loading * 1e3, "ms", LOAD_MS),
    ]


def _measured(before: str, statement: str, rounds: int) -> float:
    code = (
        f"import time\n{before}\nstart = time.perf_counter()\n{statement}\n"
        "print(time.perf_counter() - start)"
    )
    command = [sys.executable, "-c", code]
    runs = [subprocess.run(command, check=True, capture_output=True) for _ in range(rounds)]
    return float(np.median([float(done.stdout) for done in runs]))
