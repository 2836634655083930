"""Inverse kinematics of arms with two to four joints and axes in any direction.

The solutions must include every nonsingular random configuration from which a target pose was
computed. Multi-start Newton iteration must find the same number of solutions as the inverse
kinematics.
"""

import random
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from chasles.derive import SerialRobot
from chasles.derive.inverse.chosen_joints import inverses_for_fixed
from chasles.derive.inverse.families import FAMILIES
from chasles.derive.terms.terms import Terms
from tests.support.generators.arms_with_slides import robot
from tests.support.generators.drawn_arms import Derived, cases_of
from tests.support.generators.poses import PoseSet
from tests.support.oracles.verdict import counts, judged, newton

from .campaign import Campaign, Outcome
from .losses import determines, title

KINDS = ("RR", "RRR", "RRRR", "RRP", "PRR", "RRRP", "RPRR", "PRRR", "PRRP", "RPRP")
FUNCTIONS = ("ik", "ik_orientation", "ik_position")
ORIENTING = 3
"""Number of revolute joints that an orientation determines."""
POSES = 500
"""Number of random poses per inverse kinematics function."""
COUNTED = 5
"""Number of poses for which Newton's method counts the solutions."""


def arm(kinds: str, seed: int) -> SerialRobot:
    draw = random.Random(f"{kinds}{seed}")
    directions = [[draw.randint(-9, 9) for _ in range(3)] for _ in kinds]
    return robot(kinds, [d if any(d) else [1, 0, 0] for d in directions], 2 * seed)


def trial(number: int) -> Outcome:
    of_kinds = {kinds: inverses_of(arm(kinds, number)) for kinds in KINDS}
    failures = [
        f"{kinds}: no {name}"
        for kinds, cases in of_kinds.items()
        for name in sorted(expected(kinds) - {case.function for case in cases})
    ]
    every = [case for cases in of_kinds.values() for case in cases]
    failures += [fault for case in every for fault in faults(case, number)]
    counted = Counter(f"{case.function} inverses" for case in every)
    return Outcome({**counted, "poses": POSES * len(every)}, tuple(failures))


def expected(kinds: str) -> set[str]:
    """Return the names of the inverse functions that every arm of a kind must have."""
    return {"ik", "ik_orientation"} if kinds.count("R") == ORIENTING else {"ik"}


def inverses_of(robot: SerialRobot) -> list[Derived]:
    """Return the inverse kinematics functions of an arm.

    An arm with three revolute joints also has `ik_orientation`.
    """
    found = inverses_for_fixed(robot, Terms({}), FAMILIES, ())
    return [case for case in cases_of(robot, found) if case.function in FUNCTIONS]


def faults(case: Derived, number: int) -> Iterator[str]:
    """Describe configurations that `ik` does not find, and wrong numbers of solutions."""
    rng = np.random.default_rng(number)
    chosen = replace(case, free=case.still)
    poses = PoseSet("random", chosen.random(rng, POSES), regular=determines(chosen))
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
