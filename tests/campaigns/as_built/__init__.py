"""As-built robots with loops: lengths and axes differ slightly from the design.

The trials alternate between four kinds: the robot board_installer with length errors, driven arms,
shipped robots with a single error, and shipped robots with rounded numbers.
"""

from ..campaign import Campaign, Outcome
from . import built_arms, built_robots, rounded_numbers, single_errors

KINDS = (built_robots, built_arms, single_errors, rounded_numbers)


def trial(number: int) -> Outcome:
    """Derives and tests one robot with errors. The trial number selects the kind of trial."""
    return KINDS[number % len(KINDS)].trial(number)


CAMPAIGN = Campaign(
    "as_built",
    "Robots with errors close their loops, and their inverse returns every configuration.",
    trial,
)
