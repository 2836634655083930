"""Random arms with length errors, whose joints are driven by cylinders, rods and cranks.

Each trial adds errors to all lengths of a random arm. The inverse kinematics must recover the
configurations near the reference configuration, and all solutions must be correct.
"""

import tempfile
from dataclasses import dataclass

import numpy as np

import chasles
from chasles import InputValueError
from chasles.derive import Mechanism, write
from tests.support.fixed import fixed_at
from tests.support.generators.driven_arms import built_arm

from ..bars import barred
from ..campaign import Outcome

FUNCTIONS = ("fk", "fk_jacobian_mixed", "chain", "ik")
C_ALONE = ("c", "python")
POSES, REACH = 400, 0.2
"""Number of tested configurations, and maximum difference of their coordinates from the reference
configuration (radian, meter)."""
FOUND = 1e-6
"""Maximum coordinate difference (radian, meter) at which two solutions count as equal."""
BARS = {"absent": 0.0, "lost": 0.01, "wrong": 1e-10}


@dataclass(frozen=True)
class Judged:
    """Error measures of the inverse kinematics of one arm.

    Attributes:
        absent: 1 if chasles derives no inverse kinematics for the arm, otherwise 0.
        lost: Fraction of the configurations that ``ik`` does not recover.
        wrong: Largest pose error of a valid solution (position in meters, entries of the rotation
            matrix).
    """

    absent: float
    lost: float = 0.0
    wrong: float = 0.0


def trial(number: int) -> Outcome:
    return barred("driven arms", judged(number), BARS)


def judged(number: int) -> Judged:
    return judged_arm(built_arm(number), number)


def judged_arm(arm: Mechanism, number: int) -> Judged:
    """Derive and test an arm at random configurations."""
    rng = np.random.default_rng(number)
    with tempfile.TemporaryDirectory() as folder:
        try:
            write(arm, folder, functions=FUNCTIONS, languages=C_ALONE)
        except InputValueError as error:
            if "has no function ik" not in str(error):
                raise
            return Judged(1.0)
        robot = chasles.load(folder)
        reach = REACH * rng.uniform(-1, 1, (POSES, robot.n))
        q = np.array(robot.reference.q) + reach
        T = robot.fk(q)
        closed = np.isfinite(T).all((1, 2))
        q, T = q[closed], T[closed]
        found = robot.ik(T, fixed=fixed_at(robot, q))
        apart = np.abs(np.remainder(found.q - q[:, None] + np.pi, 2 * np.pi) - np.pi).max(-1)
        is_back = (np.where(found.valid, apart, np.inf) < FOUND).any(-1)
        again = robot.fk(found.q[found.valid]) - np.repeat(T, found.valid.sum(-1), 0)
        return Judged(0.0, float(1 - is_back.mean()), float(np.abs(again).max(initial=0.0)))
