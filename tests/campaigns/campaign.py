"""Data types of a campaign of random trials, and of the outcome of a trial."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Outcome:
    """The result of one trial.

    Attributes:
        counts: Number of checked items (poses, branches, files), keyed by name.
        failures: One line for each violated property.
        largest: Maximum values such as residuals, keyed by name.
    """

    counts: Mapping[str, int] = field(default_factory=dict)
    failures: tuple[str, ...] = ()
    largest: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Campaign:
    """A set of random trials that all check one property.

    Attributes:
        name: The command-line name.
        summary: The property that each trial checks, as one sentence.
        trial: Function that runs one trial. The argument of the function is the trial number, which
            seeds all random values.
    """

    name: str
    summary: str
    trial: Callable[[int], Outcome]
