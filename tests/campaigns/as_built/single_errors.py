"""``python -m bench as_built --once``: shipped robots with loops, each of their errors alone.

A robot with one length off by 0.2 mm, or one axis by 0.1 degrees, and at last with all of them, is
derived; where its loops cannot close any more, it has to say so, and is derived in least squares.
It is judged at configurations around the reference, by the gaps of its loops or by the least sum
of their squares, and by its inverse if the design has one.
"""

import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import chasles
from bench.report import out
from chasles.derive import Mechanism, RobotError, load, write
from chasles.derive.emit.languages import EMITTERS
from tests.support.generators.as_built import single_errors
from tests.support.oracles.least_gaps import LeastGaps
from tests.support.oracles.multi_start import Multistart

ROBOTS = Path(__file__).parents[2] / "derive" / "robots"
FUNCTIONS = (
    *("fk", "fk_jacobian_mixed", "chain", "configuration", "constraint", "margin"),
    *("actuators", "ik"),
)
OPTIONAL = ("margin", "actuators", "ik")
"""Functions that a robot may lack: loops that close everywhere have no margin."""
C_ALONE = ("c", "python")
LEAST_SQUARES = "least squares"
POSES, SHARPENED = 200, 5
"""Configurations, and those beside which the least sum of squares is sought."""
AROUND = 0.05
"""Share of the limits' range, or of half a turn or a metre, to both sides of the reference."""
BARS = {"open": 0, "gap": 1e-12, "least": 1e-9, "lost": 0}


@dataclass(frozen=True)
class Verdict:
    """A robot with an error.

    Attributes:
        tier: How its loops are closed: ``closed form``, ``newton`` or ``least squares``.
        open: Configurations that the design reaches and it does not.
        gap: Largest gap of loops that close, parts of the size.
        least: Largest difference from the posture of the least sum of squares (radian, metre).
        lost: Configurations that ``ik`` of their pose does not return; -1 where ``ik`` is missing
            though the design has it.
        seconds: Time of the derivation on the processor.
    """

    tier: str
    open: int
    gap: float
    least: float
    lost: int
    seconds: float

    @property
    def missed(self) -> list[str]:
        """The bars that are missed."""
        values = vars(self)
        over = [f"{key} {values[key]:.3g}" for key, bar in BARS.items() if not values[key] <= bar]
        return over + (["no ik"] if self.lost < 0 else [])


def run(names: Sequence[str]) -> int:
    """Judges robots and prints them; returns the exit status, 0 where all bars hold."""
    missed = 0
    for path in sorted(ROBOTS.glob("**/*.toml")):
        design = load(path)
        if not (isinstance(design, Mechanism) and design.closers) or path.stem not in (
            names or [path.stem]
        ):
            continue
        missed += _judged_robot(path, design)
    out.print(f"{missed} errors miss a bar")
    return int(missed > 0)


def _judged_robot(path: Path, design: Mechanism) -> int:
    """Prints the errors of a robot that miss a bar, and its sums; returns their number."""
    robot, missed, found = chasles.load(path.stem), 0, []
    for name, built in single_errors(design):
        try:
            verdict = judged(built, design, robot)
        except RobotError as error:
            out.print(f"{path.stem}, {name}: {error}", highlight=False)
            missed += 1
            continue
        found.append(verdict)
        missed += bool(verdict.missed)
        if verdict.missed:
            out.print(f"{path.stem}, {name}, {verdict.tier}: {', '.join(verdict.missed)}")
    tiers = [verdict.tier for verdict in found]
    counts = ", ".join(f"{tiers.count(tier)} {tier}" for tier in dict.fromkeys(tiers))
    worst = (f"{key} {max(vars(v)[key] for v in found):.2g}" for key in (*BARS, "seconds"))
    out.print(f"{path.stem}: {len(found)} errors ({counts}), at most {', '.join(worst)}")
    return missed


def judged(built: Mechanism, design: Mechanism, robot: chasles.Robot) -> Verdict:
    """Derives and judges a robot with an error.

    Args:
        built: The description.
        design: The same without the error.
        robot: The design, loaded.
    """
    is_led = "ik" in robot.functions
    with tempfile.TemporaryDirectory() as folder:
        start = time.process_time()
        try:
            own = _written(built, design, folder, is_led=is_led)
        except RobotError as error:
            if f'closure = "{LEAST_SQUARES}"' not in str(error):
                raise
            built, start = replace(built, closure=LEAST_SQUARES), time.process_time()
            own = _written(built, design, folder, is_led=is_led)
        seconds = time.process_time() - start
        rng = np.random.default_rng(0)
        reach = np.where(np.isfinite(robot.upper - robot.lower), robot.upper - robot.lower, np.pi)
        q = robot.reference.q + AROUND * reach * rng.uniform(-1, 1, (POSES, robot.n))
        q = q[_valid(robot, q)]
        held = _valid(own, q)
        gap, least = _gaps(own, built, q[held])
        return Verdict(
            LEAST_SQUARES if built.closure == LEAST_SQUARES else own.solution,
            int((~held).sum()),
            gap,
            least,
            _lost(own, q[held]) if is_led else 0,
            seconds,
        )


def _written(built: Mechanism, design: Mechanism, folder: str, *, is_led: bool) -> chasles.Robot:
    """The robot with the functions that are judged, as far as it has them."""
    emitters = [e for e in EMITTERS if e.language in C_ALONE]
    built, names = replace(built, nominal=design), FUNCTIONS if is_led else FUNCTIONS[:-1]
    try:
        write(built, folder, names, emitters)
    except RobotError as error:
        text = str(error).partition("has no function ")[2].partition(";")[0]
        absent = set(text.split(", "))
        if not absent & set(OPTIONAL):
            raise
        write(built, folder, [name for name in names if name not in absent], emitters)
    return chasles.load(folder)


def _valid(robot: chasles.Robot, q: np.ndarray) -> np.ndarray:
    return robot.valid(q) if hasattr(robot, "valid") else np.ones(len(q), dtype=bool)


def _gaps(robot: chasles.Robot, built: Mechanism, q: np.ndarray) -> tuple[float, float]:
    """The largest gap, and the largest difference from the least gaps where loops stay open."""
    numbers = Multistart(built)
    names = [variable.name for variable in robot.configuration_variables]
    z = robot.configuration(q)
    if built.closure != LEAST_SQUARES:
        return float(numbers.gaps(dict(zip(names, z.T, strict=True))).max()), 0.0
    oracle = LeastGaps(numbers, names, numbers.actuated)
    apart = [np.abs(oracle.least(row) - row[oracle.free]).max() for row in z[:SHARPENED]]
    return 0.0, float(max(apart, default=0.0))


def _lost(robot: chasles.Robot, q: np.ndarray) -> int:
    if "ik" not in robot.functions:
        return -1
    T = robot.fk(q)
    given = {name: robot.chain(q)[:, k] for k, name in _given(robot)}
    found = robot.ik(T, given=given) if given else robot.ik(T)
    apart = np.abs(np.remainder(found.q - q[:, None] + np.pi, 2 * np.pi) - np.pi)
    return int((np.where(found.valid[..., None], apart, np.inf).max(-1).min(-1) > 1e-8).sum())


def _given(robot: chasles.Robot) -> list[tuple[int, str]]:
    """The joints of the main chain whose values ``ik`` takes beside the pose."""
    held = robot.functions["ik"].inputs[1:]
    names = [joint.name for joint in robot.chain_joints]
    return [(names.index(argument.name), argument.name) for argument in held]
