"""Data types of a test with random trials, and of the outcome of a trial."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Outcome:
    """The result of one random trial.

    Attributes:
        counts: Number of checked items (poses, branches, files), keyed by name.
        failures: One message line for each property that the trial found violated.
        largest: Largest values that the trial found, such as residuals, keyed by name.
    """

    counts: Mapping[str, int] = field(default_factory=dict)
    failures: tuple[str, ...] = ()
    largest: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Campaign:
    """A set of random trials that all check one property.

    Attributes:
        name: The command-line name.
        summary: One sentence that states the property checked by each trial.
        trial: Function that runs one trial, given the trial number, which seeds all random values.
    """

    name: str
    summary: str
    trial: Callable[[int], Outcome]
