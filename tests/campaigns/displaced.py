"""Random tests of the inverse kinematics of arms with errors in every geometric parameter.

Even-numbered trials use an arm of the list ``ARMS``, and odd-numbered trials use a random arm with
round dimensions. Each trial draws a maximum geometric error between 0.1 and 10 (millimeter for
lengths, milliradian for angles). Each pose must have a solution, and every solution must reach its
pose. The solutions may lack at most 1 in 10,000 nonsingular random configurations. In even-numbered
trials, the solver for arms without special structure also solves the poses of six-joint arms.

Stricter rules apply to arms with errors of at most 3 mm and 3 mrad. The inverse of these arms must
return each solution only once. The solutions must contain every configuration whose Jacobian has
only singular values above 1e-3, also at joint angles that are multiples of 90 degrees. For some
poses, the solutions must include every nonsingular solution that multi-start Newton iteration
finds.
"""

from math import ceil
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import chasles
from chasles import InputValueError
from chasles.derive import SerialRobot, read
from chasles.derive.inverse.general.elimination_choice import slides_of
from tests.support.derivations import description
from tests.support.generators.drawn_arms import random_arm
from tests.support.generators.geometric_errors import displaced
from tests.support.oracles.newton_solutions import REGULAR as CLEARLY_REGULAR
from tests.support.oracles.newton_solutions import regular_solutions

from .campaign import Campaign, Outcome
from .general import PART, SIX, Judged, apart, configurations, loaded, violations

ARMS = (
    *("ur5e", "irb6640", "ur3", "puma560", "crx10", "irb120", "ur20", "kr6_r700", "gen3"),
    *("lrmate200id", "xarm6", "m0609", "ur10e", "tx2_60", "so101", "vs060", "cr5", "tm5_700"),
    *("panda", "iiwa14", "xarm7", "fr3", "stanford", "scara", "photo_robot", "lynxmotion", "xarm5"),
)
SIZES = -4.0, -2.0
"""Range of the random geometric error sizes (meter, radian), as decimal logarithms."""
RANDOM, RIGHT = 10_000, 1000
"""Number of random configurations per arm, and number of configurations at multiples of 90 degrees.
"""
MAX_LOST = 1e-4
"""Maximum fraction of nonsingular random configurations that may be missing from the solutions."""
REGULAR = 1e-4
"""Minimum singular value (m or rad per rad) of the Jacobian at an isolated solution."""
SMALL = 3e-3
"""Maximum geometric error (meter, radian) of arms that must have no missing or duplicated
solutions."""
COMPARED = 200
"""Number of poses per arm whose solutions are compared with Newton's method."""
SAME = 1e-5
"""Maximum joint difference (rad) at which two solutions count as equal."""


def trial(number: int) -> Outcome:
    is_drawn, robot = number % 2 == 1, arm_of(number)
    with TemporaryDirectory() as folder:
        try:
            arm = loaded(robot, Path(folder) / "own")
        except InputValueError:
            if not is_drawn:
                raise
            return Outcome({"arms without ik": 1})
        judged = Judged(robot, arm)
        q, right = configurations(robot, RANDOM, RIGHT, np.random.default_rng([number, 1]))
        at_random, at_right = judged.lost(q), judged.lost(right)
        counts = {
            "arms with a nominal inverse": int("ik_nominal" in arm.functions),
            "poses": RANDOM + RIGHT,
            "lost": at_random[1],
            "lost at right angles": at_right[1],
        }
        if arm.n == SIX and not is_drawn:
            general = loaded(robot, Path(folder) / "general", families=())
            counts["solutions of the general solver alone"] = fewer(arm, general, q)
        strict = strict_failures(judged, q, right) if size_of(number) <= SMALL else []
    name = robot.title if is_drawn else robot.name
    allowed = ceil(MAX_LOST * at_random[0])
    failures = [f"{name}, random: {text}" for text in violations(*at_random, allowed)]
    failures += [f"{name}, right angles: {text}" for text in violations(*at_right, np.inf)]
    failures += [f"{name}, {text}" for text in strict]
    return Outcome(counts, tuple(failures))


def arm_of(number: int) -> SerialRobot:
    shown = ARMS[number // 2 % len(ARMS)]
    robot = random_arm(number) if number % 2 else read(description(shown))
    return displaced(robot, size_of(number), number)


def size_of(number: int) -> float:
    """Return the maximum geometric error (meter, radian) for a trial number."""
    return float(10 ** np.random.default_rng(number).uniform(*SIZES))


def strict_failures(judged: Judged, q: np.ndarray, right: np.ndarray) -> list[str]:
    """Return failure messages about missing and duplicated solutions."""
    failures = []
    for name, of in {"random": q, "right angles": right}.items():
        parts = np.array_split(of, max(1, -(-len(of) // PART)))
        found = np.sum([repeated_and_missing(judged, part) for part in parts], axis=0)
        failures += [
            f"{name}: {count} {text}"
            for count, text in zip(found, ("repeated", "missing"), strict=True)
            if count
        ]
    slides = slides_of(judged.robot)
    if not slides and len(judged.robot.moving) >= SIX:
        missing = sum(fewer_than_newton(judged, row) for row in q[:COMPARED])
        failures += [f"{missing} solutions by Newton's method alone"] if missing else []
    return failures


def repeated_and_missing(judged: Judged, q: np.ndarray) -> tuple[int, int]:
    """Count duplicated solutions, and nonsingular configurations missing from the solutions."""
    arm, slides = judged.arm, slides_of(judged.robot)
    T, J = arm.fk_jacobian_mixed(q)
    found = arm.ik(T, fixed=judged.fixed(q))
    there = (found.valid & (apart(found.q, q[:, None], slides) < SAME)).any(-1)
    free = [k for k in range(q.shape[1]) if not judged.is_fixed(k)]
    regular = np.linalg.svd(J[..., free], compute_uv=False)[:, -1] > CLEARLY_REGULAR
    return int((found.count - found.distinct().count).sum()), int((regular & ~there).sum())


def fewer_than_newton(judged: Judged, q: np.ndarray) -> int:
    """Count nonsingular solutions that Newton's method finds and ``ik`` misses."""
    arm, T = judged.arm, judged.arm.fk(q)
    own = arm.ik(T, fixed=judged.fixed(q)).valid_q()
    fixed = {k: q[k] for k in range(len(q)) if judged.is_fixed(k)}
    others = regular_solutions(arm, T, fixed)
    return sum(not (apart(own, other) < SAME).any() for other in others)


def fewer(arm: chasles.Robot, general: chasles.Robot, q: np.ndarray) -> int:
    """Count nonsingular solutions that the general solver finds and the arm's own ``ik`` misses."""
    missing = 0
    for part in np.array_split(q, -(-len(q) // PART)):
        T = arm.fk(part)
        own, other = arm.ik(T), general.ik(T)
        there = apart(other.q[:, :, None], own.q[:, None]) < SAME
        is_found = (there & own.valid[:, None]).any(-1)
        rows = np.argwhere(other.valid & ~is_found)
        _, J = arm.fk_jacobian_mixed(other.q[rows[:, 0], rows[:, 1]])
        missing += int((np.linalg.svd(J, compute_uv=False)[:, -1] > REGULAR).sum())
    return missing


CAMPAIGN = Campaign(
    "displaced",
    "The inverse of an arm with errors finds nearly every configuration, and all solutions are "
    "true.",
    trial,
)
