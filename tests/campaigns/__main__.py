"""Command line of the random test campaigns, called by ``make campaign``."""

import os
import random
import time
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table
from rich.text import Text

from .campaign import Outcome
from .runner import NAMES, Tally, campaign, outcome_of, run

out = Console(highlight=False, soft_wrap=True)
PACE = 30.0
"""Minimum time between two printed progress lines [s]."""
SHOWN = 20
"""Maximum number of failures that the summary prints for each test campaign."""


def main(
    seconds: Annotated[float, typer.Option(help="Start no trial after this time.")] = 300.0,
    seed: Annotated[int | None, typer.Option(help="Of all trials; a new one by default.")] = None,
    only: Annotated[str, typer.Option(help=f"Campaigns, by comma: {', '.join(NAMES)}.")] = "",
    trial: Annotated[int | None, typer.Option(help="Repeat the trial of this number.")] = None,
    workers: Annotated[int, typer.Option(help="Trials at a time.")] = os.cpu_count() or 1,
) -> None:
    """Run random test campaigns for a limited time; the exit status is 1 if a trial fails."""
    names = [name.strip() for name in only.split(",") if name.strip()] or list(NAMES)
    if unknown := sorted(set(names) - set(NAMES)):
        message = f"no campaign {', '.join(unknown)}; there are {', '.join(NAMES)}"
        raise typer.BadParameter(message, param_hint="--only")
    if trial is not None:
        raise typer.Exit(repeat(names, trial))
    chosen = random.SystemRandom().randrange(1, 10**6) if seed is None else seed
    out.print(f"seed {chosen}, {seconds:g} s, campaigns: {', '.join(names)}")
    tallies = run(names, seconds, chosen, workers, Progress())
    summary(tallies)
    raise typer.Exit(int(any(tally.failures for tally in tallies.values())))


class Progress:
    """Prints the failures of random trials immediately, and a progress line at intervals."""

    def __init__(self) -> None:
        """Start the clock."""
        self.begin = self.last = time.monotonic()
        self.trials = 0

    def __call__(self, name: str, number: int, outcome: Outcome, seconds: float) -> None:
        self.trials += 1
        for failure in outcome.failures:
            out.print(f"{name}, trial {number}: {failure}", markup=False)
        now = time.monotonic()
        if now - self.last > PACE:
            self.last = now
            elapsed = f"{now - self.begin:.0f} s"
            out.print(f"{elapsed}: {self.trials} trials, last {name} in {seconds:.1f} s")


def repeat(names: list[str], number: int) -> int:
    """Repeat one random trial in the current process, and return 1 if the trial fails."""
    failed = False
    for name in names:
        outcome = outcome_of(campaign(name), number)
        out.print(f"{name}, trial {number}: {checked(outcome)}", markup=False)
        for failure in outcome.failures:
            out.print(f"  {failure}", markup=False)
        failed |= bool(outcome.failures)
    return int(failed)


def checked(outcome: Outcome | Tally) -> str:
    counts = [f"{count} {name}" for name, count in outcome.counts.items()]
    largest = [f"largest {name} {value:.2g}" for name, value in outcome.largest.items()]
    return ", ".join([*counts, *largest]) or "nothing checked"


def summary(tallies: dict[str, Tally]) -> None:
    """Print a table of all campaigns, and failures with the commands that repeat their trials."""
    table = Table("campaign", "trials", "seconds", "failures", "checked", title_justify="left")
    for name, tally in tallies.items():
        numbers = (tally.trials, f"{tally.seconds:.0f}", len(tally.failures))
        table.add_row(name, *map(str, numbers), Text(checked(tally)))
    out.print(table)
    for name, tally in tallies.items():
        for number, failure in tally.failures[:SHOWN]:
            out.print(f"{name}: {failure}", markup=False)
            out.print(f"  repeat: make campaign ONLY={name} TRIAL={number}")
        if len(tally.failures) > SHOWN:
            out.print(f"{name}: {len(tally.failures) - SHOWN} more failures")


if __name__ == "__main__":
    typer.run(main)
