"""Poses that inverses of random arms lose.

Each arm is derived, and each of its inverses solves poses of random coordinates, of coordinates at
right angles and of coordinates near them. Every pose needs a solution, no solution may be wrong,
and regular coordinates must be among the solutions. Nothing is compiled: the equations run in
CasADi. Poses that a robot's ``ik`` solves only by its refinement are counted as well. Six joints
without a structure are solved by compiled C alone, and are left to the campaign ``general``.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from tests.support.generators.drawn_arms import Derived, cases_for_given, cases_of, random_arm
from tests.support.generators.poses import PoseSet, nearly
from tests.support.oracles.verdict import Verdict, judged

from .campaign import Campaign, Outcome

RANDOM = 200
RIGHT = 100
ROUND_SLIDES = np.arange(-5, 6) / 10
"""Lengths of slides at right angles [m]."""
QUARTERS = np.arange(-1, 3) * (np.pi / 2)


@dataclass(frozen=True)
class Loss:
    """The verdict on an inverse of an arm and on a set of poses, where it is not clean.

    Attributes:
        arm: Number of the arm.
        structure: Its structure.
        function: The inverse.
        poses: The set.
        verdict: The counts, after the refinement that a robot's ``ik`` makes.
        unrefined: Number of poses that stay without a solution without this refinement.
    """

    arm: int
    structure: str
    function: str
    poses: str
    verdict: Verdict
    unrefined: int

    @property
    def is_real(self) -> bool:
        """Whether the refinement does not make up for it."""
        return bool(self.verdict.missed or self.verdict.wrong or self.verdict.lost)

    def __str__(self) -> str:
        """The loss in one line."""
        v = self.verdict
        return (
            f"arm {self.arm}, {self.structure}, {self.function}, {self.poses}: "
            f"{self.unrefined} unrefined, {v.missed} missed, "
            f"{v.wrong} wrong, {v.lost or 0} lost of {v.poses}"
        )


def trial(number: int) -> Outcome:
    """Judges each inverse of one random arm.

    Odd trials give joints by chance instead of the joints that the structure needs.
    """
    try:
        arm = random_arm(number)
        cases = cases_for_given(arm, number) if number % 2 else cases_of(arm)
    except TypeError:
        # A known fault of comparisons in SymPy.
        return Outcome({"arms that SymPy cannot compare": 1})
    losses = [loss for case in cases for loss in losses_of(case, number)]
    counts = {"arms with an inverse": int(bool(cases)), "inverses": len(cases)}
    counts["losses without refinement"] = len(losses)
    return Outcome(counts, tuple(str(loss) for loss in losses if loss.is_real))


def losses_of(case: Derived, seed: int) -> Iterator[Loss]:
    """The sets of poses of which an inverse loses some."""
    for chosen, poses in sets(case, np.random.default_rng(seed)):
        bare = judged(chosen, poses, chosen.answers)
        if bare.missed or bare.wrong or bare.lost:
            verdict = judged(chosen, poses, chosen.refined)
            yield Loss(seed, title(case), case.function, poses.name, verdict, bare.missed)


def sets(case: Derived, rng: np.random.Generator) -> Iterator[tuple[Derived, PoseSet]]:
    """The sets of poses of an inverse; joints that it leaves at 0 move in some of them."""
    held = replace(case, free=case.still)
    yield held, PoseSet("random", held.random(rng, RANDOM), regular=determines(held))
    q = right_angles(held, rng)
    # A swivel angle is singular at right angles where the Jacobian is not.
    regular = determines(held) and not set(held.given) & set(held.robot.functions)
    yield held, PoseSet("right angles", q, regular=regular)
    yield held, PoseSet("near right angles", nearly(held, rng, q))
    if case.still:
        yield case, PoseSet("random, all joints", case.random(rng, RANDOM))
        yield case, PoseSet("right angles, all joints", right_angles(case, rng))


def right_angles(case: Derived, rng: np.random.Generator) -> np.ndarray:
    """Coordinates (m, n) whose angles are multiples of 90 degrees and whose slides are round."""
    n = case.robot.n
    values = [
        [0.0] if k in case.free else QUARTERS if case.turns[k] else ROUND_SLIDES for k in range(n)
    ]
    sizes = [len(of) for of in values]
    if np.prod(sizes) <= RIGHT:
        return np.array(list(product(*values)))
    return np.array([[rng.choice(of) for of in values] for _ in range(RIGHT)])


def determines(case: Derived) -> bool:
    """Whether the task determines the joints that the inverse solves for, up to finitely many."""
    rows = case.jacobian(np.zeros((1, case.robot.n))).shape[-2]
    inputs = [name for name in case.given if name in case.robot.functions]
    return len(case.solved) <= rows + len(inputs)


def title(case: Derived) -> str:
    """The structure in words."""
    found = case.inverses.classification.found
    return found.title if found is not None else "no structure"


CAMPAIGN = Campaign(
    "losses",
    "No inverse of a random arm leaves a reachable pose without a solution or gives a wrong one.",
    trial,
)
