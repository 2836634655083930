"""Random tests of decoupled, intersecting and planar arms with prismatic joints, and of cranes.

Axes and lengths are random in even trials.
"""

from chasles.derive import SerialRobot
from tests.support.generators.arms_with_slides import crane, decoupled, planar
from tests.support.generators.drawn_arms import cases_of

from .campaign import Campaign, Outcome
from .losses import losses_of

DECOUPLED = ("PP", "RP", "RR", "RRP", "PPPR", "RPPPR")
MEETING = ("RRR", "PRRR", "RRRPP")
PLANAR = ("RRT", "RTR", "TRR", "RLTR", "LRTR", "TRLR")
ORDERS = ("RRP", "RPR", "PRR")


def arms_of(number: int) -> list[SerialRobot]:
    """Return a random decoupled, intersecting and planar arm, and two random cranes."""
    arms = [decoupled(DECOUPLED[number % len(DECOUPLED)], number + 2)]
    arms += [decoupled(MEETING[number % len(MEETING)], number + 2, meeting=True)]
    arms += [planar(PLANAR[number % len(PLANAR)], number)]
    order, hand = ORDERS[number % len(ORDERS)], number // 2 % 2 == 1
    for wrist in (False, True):
        round_numbers, has_hand = number % 2 == 1, hand and not wrist
        arms.append(
            crane(order, hand=has_hand, round_numbers=round_numbers, seed=number, wrist=wrist)
        )
    return arms


def trial(number: int) -> Outcome:
    cases = [case for arm in arms_of(number) for case in cases_of(arm)]
    losses = [loss for case in cases for loss in losses_of(case, number)]
    counts = {"inverses": len(cases), "losses without refinement": len(losses)}
    return Outcome(counts, tuple(str(loss) for loss in losses if loss.is_real))


CAMPAIGN = Campaign(
    "slides",
    "No inverse of an arm with prismatic joints misses a pose or gives a wrong solution.",
    trial,
)
