"""Runs campaign trials in separate processes until the time is used up."""

import os
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib import import_module
from multiprocessing import get_context
from multiprocessing.connection import Connection
from tempfile import TemporaryDirectory

from .campaign import Campaign, Outcome

NAMES = (
    *(
        "field",
        "losses",
        "structures",
        "displaced",
        "general",
        "geometries",
        "chains",
        "redundancy",
    ),
    *("mechanisms", "platforms", "planar", "loops", "as_built", "least_squares", "scenes"),
    *(
        "couplings",
        "geared",
        "statics",
        "legs",
        "carried",
        "slides",
        "small_arms",
        "urdf",
        "convert",
        "calibration",
        "tracker",
        "robust",
        "readers",
        "mutants",
        "memory",
        "exports",
    ),
)
"""Names of all test campaigns, each of which is a module of this package."""
TRIALS_OF_A_SEED = 1_000_000
"""Count of trial numbers reserved for each seed. Trial k of seed S has the number ``S *
TRIALS_OF_A_SEED + k``."""
LONGEST = 900.0
"""Time limit of a trial in seconds."""
QUICK_FLAGS = "-O1"
"""Compiler flags of most trials. Compilation with these flags is twice as fast as with the default
flags."""
USER_FLAGS_EVERY = 5
"""Trials whose number is a multiple of this value compile the robot with the default compiler
flags."""


def campaign(name: str) -> Campaign:
    found: Campaign = import_module(f"{__package__}.{name}").CAMPAIGN
    return found


@dataclass
class Tally:
    """Results of a campaign, summed over its trials.

    Attributes:
        trials: Number of finished trials.
        seconds: Total time of the finished trials.
        counts: Number of checked items by kind.
        largest: Maximum of each reported value over all trials, keyed by name.
        failures: Trial number and text of each failure.
    """

    trials: int = 0
    seconds: float = 0.0
    counts: Counter[str] = field(default_factory=Counter)
    largest: dict[str, float] = field(default_factory=dict)
    failures: list[tuple[int, str]] = field(default_factory=list)

    def add(self, number: int, outcome: Outcome, seconds: float) -> None:
        self.trials += 1
        self.seconds += seconds
        self.counts.update(outcome.counts)
        for name, value in outcome.largest.items():
            self.largest[name] = max(value, self.largest.get(name, value))
        self.failures += [(number, failure) for failure in outcome.failures]


Report = Callable[[str, int, Outcome, float], None]
"""Callback that receives campaign name, trial number, outcome and duration in seconds."""


def run(
    names: Sequence[str],
    seconds: float,
    seed: int,
    workers: int,
    report: Report,
) -> dict[str, Tally]:
    """Run campaigns in parallel. Each campaign gets the same time and at least one trial.

    After `seconds`, a trial starts only if it is the first trial of its campaign. The function
    `report` is called after each trial.
    """
    tallies = {name: Tally() for name in names}
    started: Counter[str] = Counter()
    end = time.monotonic() + seconds
    running: dict[Future[tuple[Outcome, float]], tuple[str, int]] = {}
    with ThreadPoolExecutor(workers) as pool:
        while True:
            while len(running) < workers:
                name = _next(tallies, started, is_over=time.monotonic() >= end)
                if name is None:
                    break
                number = seed * TRIALS_OF_A_SEED + started[name]
                started[name] += 1
                running[pool.submit(isolated, name, number)] = (name, number)
            if not running:
                return tallies
            for done in wait(running, return_when=FIRST_COMPLETED).done:
                name, number = running.pop(done)
                outcome, taken = done.result()
                tallies[name].add(number, outcome, taken)
                report(name, number, outcome, taken)


def _next(tallies: dict[str, Tally], started: Counter[str], *, is_over: bool) -> str | None:
    """Return the campaign of the next trial, or None if no trial may start.

    Campaigns without a started trial come first, even if the total time is over. Otherwise, until
    the total time is over, the campaign with the least used time is next.
    """
    new = [name for name in tallies if not started[name]]
    if new:
        return new[0]
    if is_over:
        return None
    # The time of a running trial is assumed to be the mean duration of the finished trials.
    return min(tallies, key=lambda name: _expected(tallies[name], started[name]))


def _expected(tally: Tally, started: int) -> float:
    return tally.seconds * started / tally.trials if tally.trials else float("inf")


def isolated(name: str, number: int) -> tuple[Outcome, float]:
    """Run a trial in a separate process, and return its outcome and duration in seconds."""
    context = get_context("forkserver")
    context.set_forkserver_preload([__name__, "chasles.derive"])
    receive, send = context.Pipe(duplex=False)
    process = context.Process(target=_send_outcome, args=(send, name, number))
    begin = time.monotonic()
    process.start()
    send.close()
    try:
        if receive.poll(LONGEST):
            outcome = receive.recv()
        else:
            process.kill()
            outcome = Outcome(failures=(f"not finished within {LONGEST:.0f} s",))
    except EOFError:
        process.join()
        outcome = Outcome(failures=(f"the process ended with exit code {process.exitcode}",))
    process.join()
    return outcome, time.monotonic() - begin


def _send_outcome(send: Connection, name: str, number: int) -> None:
    send.send(outcome_of(campaign(name), number))


def outcome_of(chosen: Campaign, number: int) -> Outcome:
    """Run a trial in this process.

    An exception counts as a failure of the trial.
    """
    try:
        with _settings(number):
            return chosen.trial(number)
    except Exception as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        text = f"{type(error).__name__}: {error} ({place.filename}:{place.lineno})"
        return Outcome(failures=(text,))


@contextmanager
def _settings(number: int) -> Iterator[None]:
    """Give a trial its own cache and compiler flags."""
    before = dict(os.environ)
    with TemporaryDirectory(prefix="chasles-campaign-") as folder:
        os.environ["CHASLES_CACHE"] = folder
        if number % USER_FLAGS_EVERY:
            os.environ["CHASLES_CFLAGS"] = QUICK_FLAGS
        try:
            yield
        finally:
            os.environ.clear()
            os.environ.update(before)
