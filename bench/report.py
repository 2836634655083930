"""Times, tables and result files shared by all benchmarks."""

import json
import platform
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from rich.console import Console
from rich.table import Table

RESULTS = Path(__file__).parent / "results"
PACKAGES = ("numpy", "sympy", "casadi", "pin", "chasles")
out = Console(width=110, highlight=False)


def seconds(work: Callable[[], object]) -> float:
    """Wall time of one run."""
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def alternated(works: Mapping[str, Callable[[], object]], rounds: int) -> dict[str, list[float]]:
    """Seconds of each work, run A B A B so that a slow moment hits all alike."""
    times: dict[str, list[float]] = {name: [] for name in works}
    for _ in range(rounds):
        for name, work in works.items():
            times[name].append(seconds(work))
    return times


def ratios(times: Mapping[str, Sequence[float]], peer: str, own: str) -> tuple[float, float]:
    """Median and smallest ratio of a peer's time to our own, round by round."""
    pairs = [a / b for a, b in zip(times[peer], times[own], strict=True)]
    return statistics.median(pairs), min(pairs)


def table(title: str, columns: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    """Prints a table, numbers to the right."""
    printed = Table(title=title, title_justify="left")
    for k, column in enumerate(columns):
        printed.add_column(column, justify="left" if k == 0 else "right")
    for row in rows:
        printed.add_row(*(_text(cell) for cell in row))
    out.print(printed)


def save(name: str, content: Mapping[str, object]) -> None:
    """Writes results with what they were measured on to ``bench/results/<name>.json``."""
    RESULTS.mkdir(exist_ok=True)
    record = {"machine": machine(), **content}
    (RESULTS / f"{name}.json").write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")


def machine() -> dict[str, str]:
    """Processor, compiler and versions."""
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


def _text(cell: object) -> str:
    return f"{cell:.3g}" if isinstance(cell, float) else str(cell)
