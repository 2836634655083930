"""Inverse of random platforms with joints before and behind the platform.

``fk`` of every valid solution slot is the target pose, and one solution slot is the generating
configuration.
"""

from tests.support.generators.carried_platforms import drawn_platform

from .campaign import Campaign, Outcome
from .legs import outcome


def trial(number: int) -> Outcome:
    """Compares the solution slots of one platform with its forward kinematics."""
    mechanism = drawn_platform(number)
    return outcome(mechanism, number, ", ".join(mechanism.actuated))


CAMPAIGN = Campaign(
    "carried",
    "Valid slots of a platform with further joints agree with its forward kinematics.",
    trial,
)
