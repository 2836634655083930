"""Inverse of random robots with joints between base and platform, and between platform and tool.

Valid solutions reach the target pose, and one of them is the generating configuration.
"""

from tests.support.generators.carried_platforms import drawn_platform

from .campaign import Campaign, Outcome
from .legs import outcome


def trial(number: int) -> Outcome:
    mechanism = drawn_platform(number)
    return outcome(mechanism, number, ", ".join(mechanism.actuated))


CAMPAIGN = Campaign(
    "carried",
    "Valid slots of a platform with further joints agree with its forward kinematics.",
    trial,
)
