"""Times, tables and result files shared by all benchmarks."""

import json
import platform
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from rich.console import Console
from rich.table import Table

RESULTS = Path(__file__).parent / "results"
PACKAGES = (
    *("chasles", "numpy", "sympy", "casadi", "pin", "roboticstoolbox-python"),
    *("wrenfold", "symforce", "jax"),
)
out = Console(width=110, highlight=False)


@dataclass(frozen=True)
class Plan:
    """Options of a benchmark run.

    Attributes:
        rounds: Number of rounds. Each round runs the compared programs in turn.
        calls: Number of Python calls per round.
        batch: Number of poses in a batch and in a C loop.
        leave_out: Other libraries to skip because they take too long.
        robots: Names of the robots to derive, or () for all shipped robots.
        chains: Numbers of joints of the chains to derive.
    """

    rounds: int
    calls: int
    batch: int
    leave_out: frozenset[str] = frozenset()
    robots: tuple[str, ...] = ()
    chains: tuple[int, ...] = (4, 8, 16, 32, 64)


@dataclass(frozen=True)
class Ratio:
    """The time of another library divided by the time of chasles, per pose or call.

    Attributes:
        key: Names of the measurement, the arm and the other library, such as "scalar ur5e fk:
            wrenfold".
        own: Minimum time of chasles [ns].
        peer: Minimum time of the other library [ns].
        median: Median time ratio of all measurement rounds. A ratio above 1 means that chasles is
            faster.
        least: Minimum time ratio of all measurement rounds.
        bar: Required median time ratio, or None if no time ratio is required.
    """

    key: str
    own: float
    peer: float
    median: float
    least: float
    bar: float | None = None

    @property
    def of_best(self) -> float:
        """The minimum time of the other library divided by the minimum time of chasles.

        Other processes affect minimum times less than mean or median times.
        """
        return self.peer / self.own

    @property
    def holds(self) -> bool:
        """Whether the median time ratio reaches the required time ratio."""
        return self.bar is None or bool(self.median >= self.bar)


@dataclass(frozen=True)
class Limit:
    """A measured value and its upper limit."""

    key: str
    value: float
    unit: str
    bar: float | None = None

    @property
    def holds(self) -> bool:
        """Whether the measured value is at most its limit."""
        return self.bar is None or bool(self.value <= self.bar)


def seconds(work: Callable[[], object], clock: Callable[[], float] = time.perf_counter) -> float:
    """Return the duration of a run [s], by default in wall time."""
    start = clock()
    work()
    return clock() - start


def alternated(
    works: Mapping[str, Callable[[], object]],
    rounds: int,
    clock: Callable[[], float] = time.process_time,
) -> dict[str, list[float]]:
    """Return the times of each function [s] from alternating runs.

    Each function first runs once without being timed. By default, the times are processor times of
    all threads of this process.
    """
    times: dict[str, list[float]] = {name: [] for name in works}
    for work in works.values():
        work()
    for _ in range(rounds):
        for name, work in works.items():
            times[name].append(seconds(work, clock))
    return times


def ratio(
    key: str,
    times: Mapping[str, Sequence[float]],
    names: tuple[str, str],
    count: int,
    bar: float | None = None,
) -> Ratio:
    """Compare the times of chasles and another library from alternating runs."""
    own, peer = (times[name] for name in names)
    pairs = [theirs / ours for ours, theirs in zip(own, peer, strict=True)]
    best = [min(found) / count * 1e9 for found in (own, peer)]
    return Ratio(key, *best, statistics.median(pairs), min(pairs), bar)


def tables(title: str, found: Sequence[Ratio | Limit]) -> None:
    """Print the results of a benchmark as tables."""
    compared = [row for row in found if isinstance(row, Ratio)]
    limited = [row for row in found if isinstance(row, Limit)]
    if compared:
        columns = ("ratio to a peer", "own ns", "peer ns", "median", "least", "bar", "")
        cells = [(r.key, r.own, r.peer, r.median, r.least, r.bar, _mark(r)) for r in compared]
        table(title, columns, cells)
    if limited:
        cells = [(row.key, row.value, row.unit, row.bar, _mark(row)) for row in limited]
        table(f"{title}: limits", ("what", "value", "unit", "bar", ""), cells)


def records(found: Sequence[Ratio | Limit]) -> list[dict[str, object]]:
    """Return the results of a benchmark for a result file."""
    return [{**asdict(row), "holds": row.holds} for row in found]


def _mark(row: Ratio | Limit) -> str:
    return "" if row.bar is None else "holds" if row.holds else "MISSED"


def table(title: str, columns: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    """Print a table with right-aligned numbers."""
    printed = Table(title=title, title_justify="left")
    for k, column in enumerate(columns):
        printed.add_column(column, justify="left" if k == 0 else "right")
    for row in rows:
        printed.add_row(*(text(cell) for cell in row))
    out.print(printed)


def save(name: str, content: Mapping[str, object]) -> None:
    """Write results and a description of the machine to ``bench/results/<name>.json``."""
    RESULTS.mkdir(exist_ok=True)
    record = {"machine": machine(), **content}
    (RESULTS / f"{name}.json").write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")


def machine() -> dict[str, str]:
    """Return processor, compiler and versions."""
    compiler = subprocess.run(["cc", "--version"], capture_output=True, text=True, check=False)
    return {
        "processor": _processor(),
        "compiler": compiler.stdout.partition("\n")[0],
        "python": sys.version.split()[0],
        **{package: _version(package) for package in PACKAGES},
    }


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return f"{names[0]}, {len(names)} cores" if names else platform.processor()


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"


def text(cell: object) -> str:
    """Format a table cell. Numbers have three significant digits."""
    if isinstance(cell, float):
        return f"{cell:.0f}" if abs(cell) >= 100 else f"{cell:.3g}"
    return "" if cell is None else str(cell)
