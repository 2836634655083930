"""``python -m bench as_built --arms``: arms that cylinders, rods and cranks move, as built.

All lengths of a drawn arm are off, and joints outside of its loops turned. A draw is judged by its
inverse, which is led from the design: whether there is one, and at configurations around the
reference whether it returns them, and nothing else.
"""

import tempfile
from dataclasses import dataclass

import numpy as np

import chasles
from bench.report import out
from chasles.derive import Mechanism, RobotError, write
from chasles.derive.emit.languages import EMITTERS
from tests.campaigns.as_built.draws import judged_draws
from tests.support.generators.driven_arms import built_arm

FUNCTIONS = ("fk", "fk_jacobian_mixed", "chain", "ik")
C_ALONE = ("c", "python")
POSES, REACH = 400, 0.2
"""Configurations, and how far their coordinates are from the reference (radian, metre)."""
FOUND = 1e-6
"""Radian and metre: coordinates of one solution."""
BARS = {"absent": 0.0, "lost": 0.01, "wrong": 1e-10}


@dataclass(frozen=True)
class Judged:
    """A draw.

    Attributes:
        absent: 1 where there is no inverse.
        lost: Share of the configurations that ``ik`` of their pose does not return.
        wrong: Largest distance of a valid solution's pose from the one asked for (metre, 1).
    """

    absent: float
    lost: float = 0.0
    wrong: float = 0.0


def judged(number: int) -> Judged:
    """Derives and judges the arm of a number, as built."""
    return judged_arm(built_arm(number), number)


def judged_arm(arm: Mechanism, number: int) -> Judged:
    """Derives and judges an arm at random configurations.

    Args:
        arm: The arm; joints that its inverse needs are given as they are.
        number: Seed of the configurations.
    """
    rng = np.random.default_rng(number)
    with tempfile.TemporaryDirectory() as folder:
        try:
            write(arm, folder, FUNCTIONS, [e for e in EMITTERS if e.language in C_ALONE])
        except RobotError as error:
            if "has no function ik" not in str(error):
                raise
            return Judged(1.0)
        robot = chasles.load(folder)
        reach = REACH * rng.uniform(-1, 1, (POSES, robot.n))
        q = np.array(robot.reference.q) + reach
        T = robot.fk(q)
        closed = np.isfinite(T).all((1, 2))
        q, T = q[closed], T[closed]
        found = robot.ik(T, *_given(robot, q))
        apart = np.abs(np.remainder(found.q - q[:, None] + np.pi, 2 * np.pi) - np.pi).max(-1)
        is_back = (np.where(found.valid, apart, np.inf) < FOUND).any(-1)
        again = robot.fk(found.q[found.valid]) - np.repeat(T, found.valid.sum(-1), 0)
        return Judged(0.0, float(1 - is_back.mean()), float(np.abs(again).max(initial=0.0)))


def _given(robot: chasles.Robot, q: np.ndarray) -> list[np.ndarray]:
    """The values (N,) of the joints that the inverse takes besides a pose."""
    names = [joint.name for joint in robot.chain_joints]
    given = robot.functions["ik"].inputs[1:]
    return [robot.chain(q)[:, names.index(joint.name)] for joint in given]


def run(draws: int, first: int) -> int:
    """Judges draws and prints them; returns the exit status, 0 where all bars hold."""
    out.print(f"{draws} driven arms, lengths off by up to half a millimetre:")
    _, missed = judged_draws(judged, range(first, first + draws), BARS)
    out.print(f"{missed} draws miss a bar")
    return int(missed > 0)
