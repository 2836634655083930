"""Shipped robots with loops, each with an error in one or all of its lengths and axes.

In each as-built robot, one length is 0.2 mm longer, one axis is rotated by 0.1 degrees, or all
lengths and axes have an error. The loops of the as-built robot must close at configurations near
the reference configuration. If the loops cannot close, the robot must report an open loop, and
minimize the sum of squared closure errors. If the designed robot has inverse kinematics, the
inverse kinematics of the as-built robot must recover the configurations that generated the tool
poses. If the loops close, ``actuators`` must recover the actuated coordinates from the joint values
of the main chain.
"""

import tempfile
from dataclasses import dataclass, replace

import numpy as np

import chasles
from chasles import InputValueError
from chasles.derive import DescriptionError, Mechanism, write
from tests.support.fixed import fixed_at
from tests.support.generators.as_built import single_errors
from tests.support.oracles.least_gaps import LeastGaps
from tests.support.oracles.multi_start import Multistart

from ..bars import barred
from ..campaign import Outcome
from ..loops import with_loops

FUNCTIONS = (
    *("fk", "fk_jacobian_mixed", "chain", "configuration", "constraint", "margin"),
    *("actuators", "ik"),
)
OPTIONAL = ("margin", "actuators", "ik")
"""Functions that some of the tested robots lack."""
C_ALONE = ("c", "python")
LEAST_SQUARES = "least squares"
POSES, SHARPENED = 200, 5
"""Number of tested configurations, and number of configurations compared with an independent
least-squares minimization."""
AROUND = 0.05
"""Maximum difference of a coordinate from its reference value, as a fraction of its limit range, or
of pi for a coordinate without limits."""
BARS = {"open": 0, "gap": 1e-12, "least": 1e-9, "lost": 0, "maps": 1e-9}


@dataclass(frozen=True)
class Judged:
    """Test results of a robot with errors in its dimensions.

    Attributes:
        tier: Closure method: ``closed form``, ``newton`` or ``least squares``.
        open: Number of configurations in which the loops of the nominal robot close but the loops
            of the as-built robot do not.
        gap: Largest remaining closure error of the solved loops, relative to the robot size.
        least: Largest joint difference from an independently computed least-squares configuration
            (radian, meter).
        lost: Number of configurations that ``ik`` does not recover, infinity if only the nominal
            robot has ``ik``, or 0 if the nominal robot has none.
        maps: Largest error of the actuated coordinates that ``actuators`` returns (radian, meter).
    """

    tier: str
    open: int
    gap: float
    least: float
    lost: float
    maps: float


def trial(number: int) -> Outcome:
    rng = np.random.default_rng(number)
    robots = with_loops("**/*.toml")
    design = robots[number // 4 % len(robots)]
    errors = list(single_errors(design))
    name, built = errors[rng.integers(len(errors))]
    title = f"{design.name}, {name}"
    try:
        found = judged(built, design, rng)
    except DescriptionError as error:
        return Outcome(failures=(f"{title}: {error}",))
    return barred(f"errors in {found.tier}", found, BARS, title)


def judged(built: Mechanism, design: Mechanism, rng: np.random.Generator) -> Judged:
    """Derive a robot with errors in its dimensions, and test its functions.

    The argument `built` is the mechanism with errors in its dimensions, and `design` is the
    mechanism without errors.
    """
    robot = chasles.load(design.name)
    has_ik = "ik" in robot.functions
    with tempfile.TemporaryDirectory() as folder:
        try:
            own = _written(built, design, folder, has_ik=has_ik)
        except DescriptionError as error:
            if f'closure = "{LEAST_SQUARES}"' not in str(error):
                raise
            built = replace(built, closure=LEAST_SQUARES)
            own = _written(built, design, folder, has_ik=has_ik)
        reach = np.where(np.isfinite(robot.upper - robot.lower), robot.upper - robot.lower, np.pi)
        q = robot.reference.q + AROUND * reach * rng.uniform(-1, 1, (POSES, robot.n))
        q = q[_valid(robot, q)]
        closed = _valid(own, q)
        gap, least = _gaps(own, built, q[closed])
        return Judged(
            LEAST_SQUARES if built.closure == LEAST_SQUARES else own.loop_solution,
            int((~closed).sum()),
            gap,
            least,
            _lost(own, q[closed]) if has_ik else 0,
            0.0 if built.closure == LEAST_SQUARES else _map_error(own, q[closed]),
        )


def _written(built: Mechanism, design: Mechanism, folder: str, *, has_ik: bool) -> chasles.Robot:
    """Derive the functions of FUNCTIONS that the robot has, and load the robot."""
    built, names = replace(built, nominal=design), FUNCTIONS if has_ik else FUNCTIONS[:-1]
    try:
        write(built, folder, functions=names, languages=C_ALONE)
    except InputValueError as error:
        text = str(error).partition("has no function ")[2].partition(";")[0]
        absent = set(text.split(", "))
        if not absent & set(OPTIONAL):
            raise
        write(
            built,
            folder,
            functions=[name for name in names if name not in absent],
            languages=C_ALONE,
        )
    return chasles.load(folder)


def _valid(robot: chasles.Robot, q: np.ndarray) -> np.ndarray:
    return robot.loops_close(q) if hasattr(robot, "loops_close") else np.ones(len(q), dtype=bool)


def _gaps(robot: chasles.Robot, built: Mechanism, q: np.ndarray) -> tuple[float, float]:
    """Return the largest closure error, and the largest distance from the least-squares minimum."""
    numbers = Multistart(built)
    names = [variable.name for variable in robot.configuration_variables]
    z = robot.configuration(q)
    if built.closure != LEAST_SQUARES:
        return float(numbers.gaps(dict(zip(names, z.T, strict=True))).max()), 0.0
    oracle = LeastGaps(numbers, names, numbers.actuated)
    apart = [np.abs(oracle.least(row) - row[oracle.free]).max() for row in z[:SHARPENED]]
    return 0.0, float(max(apart, default=0.0))


def _map_error(robot: chasles.Robot, q: np.ndarray) -> float:
    """Return the largest error of the actuated coordinates that ``actuators`` returns."""
    if "actuators" not in robot.functions:
        return 0.0
    off = robot.actuators(robot.chain(q)) - q
    return float(np.abs(np.remainder(off + np.pi, 2 * np.pi) - np.pi).max(initial=0.0))


def _lost(robot: chasles.Robot, q: np.ndarray) -> float:
    if "ik" not in robot.functions:
        return np.inf
    T = robot.fk(q)
    found = robot.ik(T, fixed=fixed_at(robot, q))
    apart = np.abs(np.remainder(found.q - q[:, None] + np.pi, 2 * np.pi) - np.pi)
    return int((np.where(found.valid[..., None], apart, np.inf).max(-1).min(-1) > 1e-8).sum())
