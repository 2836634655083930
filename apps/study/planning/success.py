"""Studies of planners: success, length and work against the number of samples and the step."""

from __future__ import annotations

import csv
import os
import time
from collections.abc import Sequence
from dataclasses import astuple, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from chasles.summaries import summary_repr

from .roadmap import Space, roadmap

_NORMAL_95 = 1.959963984540054
"""Standard deviations of a normal distribution that hold 95 % of it."""


@dataclass(frozen=True)
class Trial:
    """Roadmaps of one kind, over many keys.

    Attributes:
        samples: Number of points.
        step: Longest way.
        runs: Number of keys.
        rate: Part of the runs that found a path.
        low: Lower end of the 95 % interval of the rate, by Wilson.
        high: Its upper end.
        length: Median length of the paths; NaN without one.
        seconds: Median time of a run [s].
    """

    samples: int
    step: float
    runs: int
    rate: float
    low: float
    high: float
    length: float
    seconds: float


@dataclass(frozen=True)
class Trials:
    """A table of trials.

    Attributes:
        rows: The trials, by samples and step.
    """

    rows: tuple[Trial, ...]

    def __repr__(self) -> str:
        """In words, with the figures that matter."""
        rates = [row.rate for row in self.rows]
        found = f"rates from {min(rates):.3g} to {max(rates):.3g}" if rates else ""
        facts = (f"{len(self.rows)} rows", found)
        return summary_repr(self, "", *facts, methods="rows, plot(), to_csv(path)")

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Writes a line a trial."""
        with Path(path).open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow([item.name for item in fields(Trial)])
            writer.writerows(astuple(row) for row in self.rows)

    def plot(self, ax: Any = None) -> Any:
        """Draws the rate of success over the samples, a line a step, with 95 % intervals.

        Args:
            ax: matplotlib axes; None: a new figure.

        Returns:
            The axes.
        """
        from ..pictures import plot_trials  # noqa: PLC0415

        return plot_trials(self, ax)


def success(
    space: Space,
    start: ArrayLike,
    goal: ArrayLike,
    *,
    samples: Sequence[int],
    steps: Sequence[float] = (np.inf,),
    runs: int = 30,
    neighbours: int = 10,
) -> Trials:
    """How often roadmaps find a path, for all numbers of samples and all steps.

    Args:
        space: The space.
        start: (n,) the start.
        goal: (n,) the goal.
        samples: Numbers of points.
        steps: Longest ways.
        runs: Keys of random numbers, from 0, for each pair.
        neighbours: As in `roadmap`.

    Source:
        E. B. Wilson, Probable inference, the law of succession, and statistical inference, 1927.
    """
    rows = []
    for count in samples:
        for step in steps:
            plans, times = [], []
            for key in range(runs):
                begin = time.perf_counter()
                made = roadmap(space, count, neighbours=neighbours, step=step, key=key)
                plans.append(made.plan(start, goal))
                times.append(time.perf_counter() - begin)
            lengths = [plan.length for plan in plans if plan.found]
            low, high = wilson(len(lengths), runs)
            median = float(np.median(lengths)) if lengths else np.nan
            rate = len(lengths) / runs
            rows.append(Trial(count, step, runs, rate, low, high, median, float(np.median(times))))
    return Trials(tuple(rows))


def wilson(successes: int, runs: int) -> tuple[float, float]:
    """The 95 % interval of a rate of success."""
    z2 = _NORMAL_95**2
    rate = successes / runs
    middle = (rate + z2 / (2 * runs)) / (1 + z2 / runs)
    half = np.sqrt(rate * (1 - rate) / runs + z2 / (4 * runs**2)) * _NORMAL_95 / (1 + z2 / runs)
    return max(0.0, float(middle - half)), min(1.0, float(middle + half))
