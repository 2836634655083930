"""Random tests of the inverse kinematics of real arms whose geometry comes from external files.

Each trial tests one arm at random joint angles and at multiples of 90 degrees. A pose counts as
missed if the inverse kinematics returns no correct solution for it. A solution that is marked valid
counts as wrong if it does not reach the target pose. A nonsingular random configuration counts as
lost if the solutions for its pose do not contain this configuration. For a redundant arm, the
inverse kinematics receives the fixed joint value of the configuration from which the pose was
computed.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from tests.support.fixed import fixed_values
from tests.support.generators.field_arms import FieldArm, FieldCase, arms, derived
from tests.support.generators.poses import PoseSet
from tests.support.oracles.verdict import judged
from tests.support.peers.interface import Answers

from .campaign import Campaign, Outcome

RANDOM, RIGHT = 2000, 1000
"""Numbers of poses per arm at random joint angles and at multiples of 90 degrees."""
MAX_LOST = 1e-4
"""Maximum fraction of random configurations that may be missing from the solutions."""


def trial(number: int) -> Outcome:
    known = list(arms())
    with TemporaryDirectory() as folder:
        return judgement(known[number % len(known)], Path(folder), RANDOM, RIGHT, number)


def judgement(arm: FieldArm, folder: Path, random: int, right: int, seed: int) -> Outcome:
    """Test an arm at random joint angles and at multiples of 90 degrees.

    The arguments `random` and `right` are the numbers of poses at random joint angles and at
    multiples of 90 degrees.
    """
    try:
        derived(arm, folder)
    except RuntimeError as error:
        return Outcome(failures=(f"{arm.name}: not derived: {error}",))
    case = FieldCase(arm.name, arm=arm, folder=folder / arm.name)
    if "ik" not in case.robot.functions:
        return Outcome(failures=(f"{arm.name}: no ik",))
    if unknown := [name for name in case.given if not case.has_value(name)]:
        text = f"{arm.name}: no function gives the {', '.join(unknown)} of a configuration"
        return Outcome(failures=(text,))
    rng, n = np.random.default_rng(seed), case.robot.n
    sets = (
        PoseSet("random", rng.uniform(-np.pi, np.pi, (random, n)), regular=True),
        PoseSet("right angles", np.pi / 2 * rng.integers(-1, 3, (right, n))),
    )
    failures, largest = [], 0.0
    for poses in sets:
        found = judged(case, poses, lambda q: own(case, q))
        largest = max(largest, found.worst)
        if found.missed or found.wrong or (found.lost or 0) > MAX_LOST * found.poses:
            failures.append(
                f"{arm.name}, {case.method}, {poses.name}: {found.missed} missed, "
                f"{found.wrong} wrong, {found.lost or 0} lost of {found.poses}"
            )
    counts = {f"{case.method} arms": 1, "poses": random + right}
    return Outcome(counts, tuple(failures), {"residual": largest})


def own(case: FieldCase, q: np.ndarray) -> Answers:
    """Use chasles to solve the inverse kinematics for the tool poses at configurations (m, n)."""
    found = case.robot.ik(case.pose(q), fixed=fixed_values(case.robot, case.others(q)))
    return Answers(found.q, found.valid)


CAMPAIGN = Campaign(
    "field",
    "The inverse of an arm of another maker's file misses no pose and gives no wrong solution.",
    trial,
)
