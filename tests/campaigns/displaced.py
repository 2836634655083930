"""Derives, compiles and tests arms with errors in every parameter.

Even-numbered trials use a named arm, and odd-numbered trials use a random arm with round numbers.
Each trial draws a maximum error between 0.1 and 10 (millimeter, milliradian). Every pose needs a
solution, and no solution may be wrong. The inverse may lose at most 1 in 10,000 regular
configurations. In even-numbered trials, six-joint arms are also solved by the method for general
arms.

Stricter rules apply to arms with errors of at most 3 mm and 3 mrad. No solution is in two solution
slots. Every configuration with a smallest singular value above 1e-3 is found, also at multiples of
90 degrees. On some poses, the regular solutions must equal the set found by multi-start Newton
iteration.
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
"""Decimal logarithms of the minimum and the maximum error (meter, radian)."""
RANDOM, RIGHT = 10_000, 1000
"""Number of random configurations per arm, and number of configurations at multiples of 90 degrees.
"""
MAX_LOST = 1e-4
"""Maximum fraction of regular random configurations that may be missing."""
REGULAR = 1e-4
"""Minimum singular value (m or rad per rad) at an isolated solution."""
SMALL = 3e-3
"""Maximum errors (meter, radian) of arms without missing or duplicated solutions."""
COMPARED = 200
"""Number of poses per arm at which Newton's method is used to count the solutions."""
SAME = 1e-5
"""Maximum difference (rad) at which solutions of the two solvers count as equal."""


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
    """Return the error size (meter, radian) for a trial number."""
    return float(10 ** np.random.default_rng(number).uniform(*SIZES))


def strict_failures(judged: Judged, q: np.ndarray, right: np.ndarray) -> list[str]:
    """Describe missing and duplicated solutions."""
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
    """Count duplicated solutions and missing regular configurations."""
    arm, slides = judged.arm, slides_of(judged.robot)
    T, J = arm.fk_jacobian_mixed(q)
    found = arm.ik(T, fixed=judged.fixed(q))
    there = (found.valid & (apart(found.q, q[:, None], slides) < SAME)).any(-1)
    free = [k for k in range(q.shape[1]) if not judged.is_fixed(k)]
    regular = np.linalg.svd(J[..., free], compute_uv=False)[:, -1] > CLEARLY_REGULAR
    return int((found.count - found.distinct().count).sum()), int((regular & ~there).sum())


def fewer_than_newton(judged: Judged, q: np.ndarray) -> int:
    """Count regular solutions that only Newton's method finds."""
    arm, T = judged.arm, judged.arm.fk(q)
    own = arm.ik(T, fixed=judged.fixed(q)).valid_q()
    fixed = {k: q[k] for k in range(len(q)) if judged.is_fixed(k)}
    others = regular_solutions(arm, T, fixed)
    return sum(not (apart(own, other) < SAME).any() for other in others)


def fewer(arm: chasles.Robot, general: chasles.Robot, q: np.ndarray) -> int:
    """Count regular solutions that the general solver finds and the inverse of the arm misses."""
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
