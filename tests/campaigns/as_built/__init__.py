"""As-built robots with loops: lengths and axes differ slightly from the design."""

from ..campaign import Campaign, Outcome
from . import built_arms, built_robots, rounded_numbers, single_errors

KINDS = (built_robots, built_arms, single_errors, rounded_numbers)


def trial(number: int) -> Outcome:
    """Derive a robot with errors in its dimensions and test its functions.

    The trial number selects the kind of robot: board installer, driven arm, robot with single
    errors, or robot with rounded numbers.
    """
    return KINDS[number % len(KINDS)].trial(number)


CAMPAIGN = Campaign(
    "as_built",
    "Robots with errors close their loops, and their inverse returns every configuration.",
    trial,
)
