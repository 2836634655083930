"""``python -m bench losses``: the poses that inverses of random arms lose, arm by arm.

Each arm of ``bench/cases/drawn_arms.py`` is derived, and each of its inverses is asked for poses
of random coordinates, of coordinates at right angles and of ones near them. No pose may stay
without a solution, no solution may be wrong, and regular coordinates must be among the solutions.
Nothing is compiled: the equations run in CasADi. Poses that a robot's ``ik`` solves only by its
refinement are counted as well. Six joints without a structure are solved by compiled C alone, and
are not asked.
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from ..cases.drawn_arms import Derived, cases_for_given, cases_of, random_arm
from ..cases.poses import PoseSet, nearly
from ..report import out
from .verdict import Verdict, judged

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


def run(arms: int, first: int, *, given: bool = False) -> int:
    """Prints each loss and the sums; returns 1 if anything is lost.

    Args:
        arms: Number of arms.
        first: Number of the first arm.
        given: Whether joints are given by chance instead of those that the structure needs.
    """
    asked: Counter[str] = Counter()
    losses: list[Loss] = []
    underived = solved = 0
    for seed in range(first, first + arms):
        try:
            arm = random_arm(seed)
            cases = cases_for_given(arm, seed) if given else cases_of(arm)
        except TypeError as error:
            # A known fault of comparisons in SymPy, which is counted and shown.
            out.print(f"arm {seed} is not derived: {error}")
            underived += 1
            continue
        solved += bool(cases)
        for case in cases:
            asked[f"{title(case)}, {case.function}"] += 1
            for loss in losses_of(case, seed):
                losses.append(loss)
                out.print(str(loss))
    for name, count in sorted(asked.items()):
        out.print(f"{count:5d} {name}")
    out.print(
        f"{arms} arms, {solved} with an inverse, {underived} not derived; "
        f"{len({loss.arm for loss in losses if loss.is_real})} lose something, "
        f"{len({loss.arm for loss in losses})} without refinement"
    )
    return int(any(loss.is_real for loss in losses))


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
