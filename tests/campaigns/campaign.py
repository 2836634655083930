"""What a campaign is, and what a trial of it returns."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Outcome:
    """The result of one trial.

    Attributes:
        counts: How much was checked, by name: poses, branches, files. Trials add up.
        failures: One line for each property that was violated.
        largest: Values whose maximum over all trials is of interest, by name: residuals.
    """

    counts: Mapping[str, int] = field(default_factory=dict)
    failures: tuple[str, ...] = ()
    largest: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Campaign:
    """Trials of one kind.

    Attributes:
        name: The name on the command line.
        summary: The property that each trial checks, in one sentence.
        trial: Runs the trial of a number. All random values of the trial depend on the number
            alone, so that the number repeats the trial.
    """

    name: str
    summary: str
    trial: Callable[[int], Outcome]
