"""Inverse kinematics of random robots with joints before and after a platform.

Valid solutions must reach the target pose, and one of them must be the configuration that generated
the pose.
"""

from chasles.derive.inverse.mechanisms.backward_inverse import missing
from chasles.derive.loops.closing.loop_model import loop_model
from chasles.derive.loops.solve.solved_loops import solved_loops
from tests.support.generators.carried_planes import drawn_planes
from tests.support.generators.carried_platforms import drawn_platform

from .campaign import Campaign, Outcome
from .legs import outcome


def trial(number: int) -> Outcome:
    if number % 2:
        planes, kind = drawn_planes(number // 2)
        if missing(solved_loops(loop_model(planes))):
            return Outcome({"platforms without ik": 1}, ())
        return outcome(planes, number, kind)
    mechanism = drawn_platform(number)
    return outcome(mechanism, number, ", ".join(mechanism.actuated))


CAMPAIGN = Campaign(
    "carried",
    "Valid slots of a platform with further joints agree with its forward kinematics.",
    trial,
)
