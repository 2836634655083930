"""Tests the inverses of arms with two to four joints and axes in any direction.

Each regular random configuration must be among the solutions, and Newton iteration from many starts
must find the same number of solutions.
"""

import random
from collections.abc import Iterator

import numpy as np

from chasles.derive import SerialRobot
from tests.support.generators.arms_with_slides import robot
from tests.support.generators.drawn_arms import Derived, cases_of
from tests.support.oracles.verdict import counts, judged, newton

from .campaign import Campaign, Outcome
from .losses import sets, title

KINDS = ("RR", "RRR", "RRRR", "RRP", "PRR", "RRRP", "RPRR", "PRRP", "RPRP")
FUNCTIONS = ("ik", "ik_orientation", "ik_position")
COUNTED = 5
"""Number of poses whose solutions Newton's method counts."""


def arm(kinds: str, seed: int) -> SerialRobot:
    """Returns an arm with axes in any direction."""
    draw = random.Random(f"{kinds}{seed}")
    directions = [[draw.randint(-9, 9) for _ in range(3)] for _ in kinds]
    return robot(kinds, [d if any(d) else [1, 0, 0] for d in directions], 2 * seed)


def trial(number: int) -> Outcome:
    """Tests each inverse of one arm of each kind."""
    cases = [
        case
        for kinds in KINDS
        for case in cases_of(arm(kinds, number))
        if case.function in FUNCTIONS
    ]
    failures = [fault for case in cases for fault in faults(case, number)]
    return Outcome({"inverses": len(cases)}, tuple(failures))


def faults(case: Derived, number: int) -> Iterator[str]:
    """Yields descriptions of lost configurations and of different numbers of solutions."""
    rng = np.random.default_rng(number)
    chosen, poses = next(sets(case, rng))
    found = judged(chosen, poses, chosen.refined)
    if found.missed or found.wrong or found.lost:
        yield f"{title(case)}, {case.function}, {case.name}: {found}"
    q = poses.q[:COUNTED]
    expected = [len(newton(chosen, row, rng)) for row in q]
    reported = counts(chosen, chosen.refined(q)).tolist()
    if reported != expected:
        yield f"{title(case)}, {case.function}: {reported} solutions, Newton's method {expected}"


CAMPAIGN = Campaign(
    "small_arms",
    "Arms with up to four joints have all solutions of multi-start Newton iteration.",
    trial,
)
