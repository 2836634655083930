"""Searches for poses of random arms for which the inverse kinematics misses solutions.

Each inverse kinematics function of a random arm solves poses at random coordinates, at multiples of
90 degrees and near these multiples. Each pose must have a solution, and every solution must reach
its pose. CasADi evaluates the derived equations, so the test compiles no C code. Poses that ``ik``
solves only after refinement are also counted. Six-joint arms that belong to no closed-form family
need compiled C code, so the campaign ``general`` tests these arms.
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
"""Prismatic joint values in configurations with multiples of 90 degrees [m]."""
QUARTERS = np.arange(-1, 3) * (np.pi / 2)


@dataclass(frozen=True)
class Loss:
    """Failures of one inverse kinematics function on one set of poses.

    Attributes:
        arm: Trial number of the random arm.
        structure: Description of the arm's structure.
        function: Name of the inverse kinematics function.
        poses: Name of the pose set.
        verdict: Numbers of unsolved poses, wrong solutions and lost configurations after
            refinement.
        unrefined: Number of unsolved poses without refinement.
    """

    arm: int
    structure: str
    function: str
    poses: str
    verdict: Verdict
    unrefined: int

    @property
    def is_real(self) -> bool:
        """Test whether failures remain after the refinement of the solutions."""
        return bool(self.verdict.missed or self.verdict.wrong or self.verdict.lost)

    def __str__(self) -> str:
        """Return a one-line description."""
        v = self.verdict
        return (
            f"arm {self.arm}, {self.structure}, {self.function}, {self.poses}: "
            f"{self.unrefined} unrefined, {v.missed} missed, "
            f"{v.wrong} wrong, {v.lost or 0} lost of {v.poses}"
        )


def trial(number: int) -> Outcome:
    """Test each IK function of a random arm, with random fixed joints in odd-numbered trials."""
    try:
        arm = random_arm(number)
        cases = cases_for_given(arm, number) if number % 2 else cases_of(arm)
    except TypeError:
        # SymPy raises a TypeError in comparisons for some arms.
        return Outcome({"arms that SymPy cannot compare": 1})
    losses = [loss for case in cases for loss in losses_of(case, number)]
    counts = {"arms with an inverse": int(bool(cases)), "inverses": len(cases)}
    counts["losses without refinement"] = len(losses)
    return Outcome(counts, tuple(str(loss) for loss in losses if loss.is_real))


def losses_of(case: Derived, seed: int) -> Iterator[Loss]:
    """Yield the failure counts of each pose set that the IK function without refinement misses."""
    for chosen, poses in sets(case, np.random.default_rng(seed)):
        bare = judged(chosen, poses, chosen.answers)
        if bare.missed or bare.wrong or bare.lost:
            verdict = judged(chosen, poses, chosen.refined)
            yield Loss(seed, title(case), case.function, poses.name, verdict, bare.missed)


def sets(case: Derived, rng: np.random.Generator) -> Iterator[tuple[Derived, PoseSet]]:
    fixed = replace(case, free=case.still)
    yield fixed, PoseSet("random", fixed.random(rng, RANDOM), regular=determines(fixed))
    q = right_angles(fixed, rng)
    # At multiples of 90 degrees, a swivel angle may be singular although the Jacobian is regular.
    regular = determines(fixed) and not set(fixed.given) & set(fixed.robot.functions)
    yield fixed, PoseSet("right angles", q, regular=regular)
    yield fixed, PoseSet("near right angles", nearly(fixed, rng, q))
    if case.still:
        yield case, PoseSet("random, all joints", case.random(rng, RANDOM))
        yield case, PoseSet("right angles, all joints", right_angles(case, rng))


def right_angles(case: Derived, rng: np.random.Generator) -> np.ndarray:
    """Return configurations (m, n) of multiples of 90 degrees and round prismatic joint values."""
    n = case.robot.n
    values = [
        [0.0] if k in case.free else QUARTERS if case.turns[k] else ROUND_SLIDES for k in range(n)
    ]
    sizes = [len(of) for of in values]
    if np.prod(sizes) <= RIGHT:
        return np.array(list(product(*values)))
    return np.array([[rng.choice(of) for of in values] for _ in range(RIGHT)])


def determines(case: Derived) -> bool:
    """Test whether the inverse kinematics task of a test case has finitely many solutions."""
    rows = case.jacobian(np.zeros((1, case.robot.n))).shape[-2]
    inputs = [name for name in case.given if name in case.robot.functions]
    return len(case.solved) <= rows + len(inputs)


def title(case: Derived) -> str:
    found = case.inverses.classification.found
    return found.title if found is not None else "no structure"


CAMPAIGN = Campaign(
    "losses",
    "No inverse of a random arm leaves a reachable pose without a solution or gives a wrong one.",
    trial,
)
