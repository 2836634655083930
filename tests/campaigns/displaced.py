"""``python -m bench displaced``: arms with random errors in every parameter, judged and timed.

Each draw takes a shipped arm or one of the shelf, or with --drawn an arm of round numbers, and
displaces every joint and the tool by errors of up to a size between 0.1 and 10 (millimetre,
milliradian). A line tells, for random poses,

    near     whether the arm is led from a nominal one: 1, or is solved otherwise: 0
    lost     poses of which the configuration that made them is not among the solutions
    none     poses without any solution
    wrong    solutions called valid whose pose, in extended precision, is off by more than 1e-8
    fewer    solutions of the same arm solved as a general one that are not among the solutions
    single, p99, batch   microseconds a pose, on one thread

and for poses at right angles, lost (right_lost), without any solution (right_none) and wrong
(right_wrong). A configuration at which the Jacobian is singular is not looked for.
"""

import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from math import ceil
from pathlib import Path

import numpy as np

import chasles
from bench.report import out, seconds
from chasles.derive import Robot, RobotError, derive, load
from chasles.derive.build.generate import files_of, put
from chasles.derive.emit.languages import EMITTERS
from tests.campaigns.general import DERIVED, SIX, Judged, apart, configurations
from tests.support.generators.drawn_arms import random_arm
from tests.support.generators.geometric_errors import displaced

ROBOTS = Path(__file__).parents[2] / "derive" / "robots"
ARMS = (
    *("ur5e", "irb6640", "ur3", "puma560", "crx10", "irb120", "ur20", "kr6_r700", "gen3"),
    *("lrmate200id", "xarm6", "m0609", "ur10e", "tx2_60", "so101", "vs060", "cr5", "tm5_700"),
    *("panda", "iiwa14", "xarm7", "fr3", "stanford", "scara", "photo_robot", "lynxmotion", "xarm5"),
)
SIZES = -4.0, -2.0
"""Decimal logarithms of the least and the greatest error (metre, radian)."""
LEAST = 1e-4
"""Least singular value (m or rad per rad) at a solution that is told from others."""
BESIDE = 1e-5
"""rad: solutions of the two solvers closer than this are one."""
C_ALONE = [emitter for emitter in EMITTERS if emitter.language in ("c", "python")]
ROUNDS = 3
PART = 1000
"""Poses of which all solutions are compared at a time."""
COUNTS = ("lost", "none", "wrong")
BARS = {"none": 0, "wrong": 0, "lost": 1e-4, "right_none": 0, "right_wrong": 0, "p99": 50.0}
"""Greatest values; of lost poses, the share."""


@dataclass(frozen=True)
class Draw:
    """An arm with errors.

    Attributes:
        name: The arm without errors.
        size: The greatest error (metre, radian).
        robot: The description.
    """

    name: str
    size: float
    robot: Robot

    @classmethod
    def of(cls, number: int, *, drawn: bool = False) -> "Draw":
        """The draw of a number, which is the seed as well; of an arm that nobody chose."""
        name = f"arm {number}" if drawn else ARMS[number % len(ARMS)]
        robot = random_arm(number) if drawn else load(described(name))
        size = float(10 ** np.random.default_rng(number).uniform(*SIZES))
        return cls(name, size, displaced(robot, size, number))

    def loaded(self, folder: Path, **families: tuple[()]) -> chasles.Robot:
        """Its functions, derived into a folder."""
        derivation = derive(self.robot, DERIVED, **families)
        put(files_of(derivation, C_ALONE), folder)
        return chasles.load(folder)


def described(name: str) -> Path:
    """The file of a shipped arm or of one on the shelf."""
    own = ROBOTS / f"{name}.toml"
    return own if own.is_file() else ROBOTS / "shelf" / own.name


def judgement(draw: Draw, poses: int, singles: int, *, beside: bool = True) -> dict[str, float]:
    """What is found for a draw, by name.

    Args:
        draw: The arm.
        poses: Number of random poses.
        singles: How many of them are timed one by one.
        beside: Whether six joints are solved as a general arm as well.
    """
    with tempfile.TemporaryDirectory() as folder:
        start = time.process_time()
        arm = draw.loaded(Path(folder) / "own")
        found = {"derived": time.process_time() - start}
        found["near"] = "ik_nominal" in arm.functions
        judged = Judged(draw.robot, arm)
        q, right = configurations(draw.robot, poses, poses // 10)
        parts = [judged.lost(part) for part in np.array_split(q, -(-poses // PART))]
        counts = np.sum(parts, axis=0)
        found |= dict(zip(("regular", *COUNTS), map(int, counts), strict=True))
        names = ("right", *(f"right_{name}" for name in COUNTS))
        found |= dict(zip(names, map(int, judged.lost(right)), strict=True))
        if beside and arm.n == SIX:
            general = draw.loaded(Path(folder) / "general", families=())
            found["fewer"] = fewer(arm, general, q)
        T, given = arm.fk(q), judged.given(q)
        rows = list(zip(T[:singles], *(values[:singles] for values in given), strict=True))
        taken = [min(seconds(partial(arm.ik, *row)) for _ in range(ROUNDS)) for row in rows]
        found["single"], found["p99"] = 1e6 * np.percentile(taken, (50, 99))
        found["batch"] = 1e6 * least(partial(arm.ik, T, *given, threads=1)) / poses
    return found


def fewer(arm: chasles.Robot, general: chasles.Robot, q: np.ndarray) -> int:
    """How many regular solutions of a general arm are not among an arm's."""
    missing = 0
    for part in np.array_split(q, -(-len(q) // PART)):
        T = arm.fk(part)
        own, other = arm.ik(T), general.ik(T)
        there = apart(other.q[:, :, None], own.q[:, None]) < BESIDE
        held = (there & own.valid[:, None]).any(-1)
        rows = np.argwhere(other.valid & ~held)
        _, J = arm.fk_jacobian_mixed(other.q[rows[:, 0], rows[:, 1]])
        missing += int((np.linalg.svd(J, compute_uv=False)[:, -1] > LEAST).sum())
    return missing


def least(work: partial[object]) -> float:
    """The least processor time of some rounds [s]."""
    return min(seconds(work, time.process_time) for _ in range(ROUNDS))


def missed(found: dict[str, float]) -> list[str]:
    """The names of the bars that a draw misses."""
    allowed = BARS | {"lost": ceil(BARS["lost"] * found["regular"])}
    return [name for name, bar in allowed.items() if found[name] > bar]


def run(numbers: Sequence[int], poses: int, singles: int, *, drawn: bool = False) -> int:
    """Prints a line for each draw; returns 1 if one misses a bar.

    Args:
        numbers: Of the draws.
        poses: As of :func:`judgement`.
        singles: As of :func:`judgement`.
        drawn: Whether arms of round numbers are displaced; those without ``ik`` are passed over.
    """
    failed = without = 0
    for number in numbers:
        draw = Draw.of(number, drawn=drawn)
        try:
            found = judgement(draw, poses, singles, beside=not drawn)
        except RobotError as error:
            if not drawn:
                out.print(f"{number:3} {draw.name:12} {1e3 * draw.size:5.2f}: {str(error)[:60]}")
            failed += not drawn
            without += 1
            continue
        text = " ".join(f"{name} {value:.4g}" for name, value in found.items())
        over = missed(found)
        out.print(
            f"{number:3} {draw.name:12} {1e3 * draw.size:5.2f}: {text}"
            + (f"; misses {', '.join(over)}" if over else ""),
            soft_wrap=True,
        )
        failed += bool(over)
    out.print(f"{len(numbers)} draws, {without} without ik, {failed} miss a bar")
    return int(failed > 0)
