"""Robots with loops as built: lengths and axes that differ a little from the design.

The trials alternate between board installers with length errors, arms that cylinders, rods and
cranks drive, shipped robots with one error of a length or an axis, and shipped robots in rounded
numbers.
"""

from ..campaign import Campaign, Outcome
from . import built_arms, built_robots, rounded_numbers, single_errors

KINDS = (built_robots, built_arms, single_errors, rounded_numbers)


def trial(number: int) -> Outcome:
    """Derives and judges one robot with errors; the number chooses the kind."""
    return KINDS[number % len(KINDS)].trial(number)


CAMPAIGN = Campaign(
    "as_built",
    "Robots with errors close their loops, and their inverse returns every configuration.",
    trial,
)
