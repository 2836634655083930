"""Success rate of roadmaps as a function of the number of points and the maximum edge length."""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from dataclasses import astuple, dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from chasles import InputValueError
from chasles.contract import check_type
from chasles.summaries import summary_repr

from ..arguments import Rng, integer_at_least, key_of, number
from ..results import StudyResult, write_table
from .plan import Space
from .roadmap import prm

_NORMAL_95 = 1.959963984540054
"""Half width of the central 95 % interval of a normal distribution, in standard deviations."""


@dataclass(frozen=True)
class Trial:
    """Results of roadmaps with the same number of points and maximum edge length.

    Attributes:
        samples: Number of free points to sample for each roadmap.
        max_step: Maximum Euclidean length of an edge in the coordinates.
        runs: Number of roadmaps in the trial.
        rate: Fraction of the roadmaps on which a path was found.
        lower: Lower end of the 95 % Wilson confidence interval of `rate`.
        upper: Upper end of the 95 % Wilson confidence interval of `rate`.
        length: Median length of the found paths, or NaN if no path was found.
        seconds: Median time [s] to make a roadmap and plan a path on it.
    """

    samples: int
    max_step: float
    runs: int
    rate: float
    lower: float
    upper: float
    length: float
    seconds: float


@dataclass(frozen=True)
class SuccessStudy(StudyResult):
    """Success rates of roadmaps, from `success_study`.

    Attributes:
        rows: A `Trial` for each pair of sample count and maximum edge length.
    """

    _parts = (Trial,)

    rows: tuple[Trial, ...]

    def __repr__(self) -> str:
        """Short summary with the main values."""
        rates = [row.rate for row in self.rows]
        found = f"rates from {min(rates):.3g} to {max(rates):.3g}" if rates else ""
        facts = (f"{len(self.rows)} rows", found)
        return summary_repr(self, "", *facts, methods="rows, plot(), save(path)")

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Write a .csv file with a row per trial."""
        names = [item.name for item in fields(Trial)]
        write_table(path, names, [astuple(row) for row in self.rows])

    def plot(self, ax: Any = None) -> Any:
        """Plot the success rate against the number of samples, with 95 % confidence intervals.

        The plot contains one line for each maximum edge length.

        Args:
            ax: matplotlib axes, or None for a new figure.

        Returns:
            The axes.
        """
        from ..pictures import plot_success  # noqa: PLC0415

        return plot_success(self, ax)


def success_study(
    space: Space,
    q_start: ArrayLike,
    q_goal: ArrayLike,
    *,
    samples: Sequence[int],
    max_steps: Sequence[float] = (np.inf,),
    runs: int = 30,
    neighbors: int = 10,
    rng: Rng = 0,
) -> SuccessStudy:
    """Return how often roadmaps find a path, for each sample count and maximum edge length.

    Args:
        space: The space, such as a `ConfigurationSpace` or an `OccupancyMap`.
        q_start: (n,) coordinates of the start.
        q_goal: (n,) coordinates of the goal.
        samples: Values of the argument `samples` of `prm` to compare.
        max_steps: Values of the argument `max_step` of `prm` to compare.
        runs: Number of roadmaps, with different random numbers, for each pair of `samples` and
            `max_steps`.
        neighbors: Maximum number of nearest points to which each point is connected.
        rng: A seed (an int of at least 0), a `numpy.random.Generator`, or None for fresh random
            numbers.

    Raises:
        InputTypeError: `space` is not a `Space`, or another argument has the wrong type.
        InputValueError: `runs`, `neighbors`, or a number in `samples` or `max_steps` is not above
            0.

    Source:
        E. B. Wilson, Probable inference, the law of succession, and statistical inference, 1927.
    """
    check_type("success_study: space", space, Space)
    check_type("success_study: samples", samples, Sequence, np.ndarray)
    check_type("success_study: max_steps", max_steps, Sequence, np.ndarray)
    counts = [integer_at_least("success_study: samples", count, 1) for count in samples]
    runs = integer_at_least("success_study: runs", runs, 1)
    neighbors = integer_at_least("success_study: neighbors", neighbors, 1)
    for step in max_steps:
        if not number("success_study: max_steps", step) > 0:
            raise InputValueError(f"success_study: max_steps: expected values above 0, got {step}")
    rows, first = [], runs * key_of("success_study", rng)
    for count in counts:
        for step in max_steps:
            plans, times = [], []
            for key in range(first, first + runs):
                begin = time.perf_counter()
                made = prm(space, count, neighbors=neighbors, max_step=step, rng=key)
                plans.append(made.plan(q_start, q_goal))
                times.append(time.perf_counter() - begin)
            lengths = [plan.length for plan in plans if plan.found]
            lower, upper = wilson(len(lengths), runs)
            median = float(np.median(lengths)) if lengths else np.nan
            rate, seconds = len(lengths) / runs, float(np.median(times))
            rows.append(Trial(count, step, runs, rate, lower, upper, median, seconds))
    return SuccessStudy(tuple(rows))


def wilson(successes: int, runs: int) -> tuple[float, float]:
    """Return the 95 % Wilson confidence interval of a success rate."""
    z2 = _NORMAL_95**2
    rate = successes / runs
    middle = (rate + z2 / (2 * runs)) / (1 + z2 / runs)
    half = np.sqrt(rate * (1 - rate) / runs + z2 / (4 * runs**2)) * _NORMAL_95 / (1 + z2 / runs)
    return max(0.0, float(middle - half)), min(1.0, float(middle + half))
