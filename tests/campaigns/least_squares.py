"""``python -m bench least_squares``: mechanisms with joints off their places, in least squares.

Rods on pins become links, every joint and closure is moved by up to 0.5 mm and turned by up to
2 mrad about each axis, and the loops are closed in least squares. A draw is judged beside the
posture that exact derivatives of gaps give which the compiler has no part in, by its derivatives
beside differences, and by its ways back: ``actuators`` of its chain, and ``ik`` of its poses.
"""

import tempfile
import time
from dataclasses import dataclass
from itertools import cycle, islice
from pathlib import Path

import numpy as np

import chasles
from bench.report import out
from chasles.derive import Mechanism, load, write
from chasles.derive.emit.languages import EMITTERS
from chasles.derive.model.robot import Placement
from tests.campaigns.as_built.draws import judged_draws
from tests.support.generators.as_built import UPRIGHT, on_links, out_of_plane
from tests.support.oracles.least_gaps import LeastGaps
from tests.support.oracles.multi_start import Multistart

ROBOTS = Path(__file__).parents[2] / "derive" / "robots"
PLANES: dict[str, Placement] = {
    "board_installer": (UPRIGHT,),
    "four_bar": (),
    "slider_crank": (),
    "five_bar": (),
}
"""The robots, and the turn of z to the axis of their pins."""
FUNCTIONS = (
    *("fk", "fk_jacobian_mixed", "configuration", "configuration_D_q", "margin"),
    *("chain", "chain_D_q", "chain_rates", "chain_accelerations"),
    *("actuators", "actuators_D_chain", "ik"),
)
C_ALONE = ("c", "python")
POSES, JUDGED = 100, 10
"""Configurations of a draw, and those that are solved by exact derivatives too."""
STEP = 1e-6
"""Radian and metre, of central differences."""
BARS = {"closure": 1e-9, "slope": 1e-6, "rate": 1e-6, "back": 1e-9, "lost": 0.0, "open": 0.0}


@dataclass(frozen=True)
class Judged:
    """A draw.

    Attributes:
        closure: Largest difference of a joint from the least sum of squares (radian, metre).
        slope: Largest error of the derivative of the configuration.
        rate: Of the accelerations of the main chain at unit rates.
        back: Largest difference of coordinates after the way to the main chain and back.
        lost: Poses whose coordinates ``ik`` does not return; none where it has no inverse.
        open: Configurations within a tenth of the limits' range that are not reached.
        derived: CPU time of the derivation (second).
    """

    closure: float
    slope: float
    rate: float
    back: float
    lost: float
    open: float
    derived: float


def drawn(number: int) -> Mechanism:
    """The description of a draw."""
    name = next(islice(cycle(PLANES), number, None))
    whole = on_links(load(ROBOTS / f"{name}.toml"), PLANES[name])
    return out_of_plane(whole, np.random.default_rng(number))


def judged(number: int) -> Judged:
    """Derives and judges a draw."""
    mechanism = drawn(number)
    rng = np.random.default_rng(number)
    with tempfile.TemporaryDirectory() as folder:
        start = time.process_time()
        names = FUNCTIONS if mechanism.name == "board_installer" else FUNCTIONS[:-1]
        write(mechanism, folder, names, [e for e in EMITTERS if e.language in C_ALONE])
        derived = time.process_time() - start
        robot = chasles.load(folder)
        q = _around(robot, rng)
        held = robot.valid(q)
        open_, q = float((~held).sum()), q[held]
        v = rng.uniform(-1, 1, q.shape)
        return Judged(
            _beside_least(robot, Multistart(mechanism), q[:JUDGED]),
            _slope(robot, q, v),
            _rate(robot, q, v),
            _back(robot, q),
            _lost(robot, q) if "ik" in names else 0.0,
            open_,
            derived,
        )


def _around(robot: chasles.Robot, rng: np.random.Generator) -> np.ndarray:
    """Coordinates (POSES, n) within a tenth of their range of the reference."""
    limits = np.array([(c.lower, c.upper) for c in robot.coordinates], dtype=float)
    span = np.where(np.isfinite(limits).all(-1), limits[:, 1] - limits[:, 0], np.pi)
    return robot.reference.q + 0.1 * span * rng.uniform(-1, 1, (POSES, robot.n))


def _beside_least(robot: chasles.Robot, numbers: Multistart, q: np.ndarray) -> float:
    names = [variable.name for variable in robot.configuration_variables]
    oracle = LeastGaps(numbers, names, numbers.actuated)
    apart = (oracle.least(z) - z[oracle.free] for z in robot.configuration(q))
    return max(float(np.abs(of).max()) for of in apart)


def _slope(robot: chasles.Robot, q: np.ndarray, v: np.ndarray) -> float:
    before, after = (robot.configuration(q + sign * STEP * v) for sign in (-1, 1))
    along = np.einsum("Nij,Nj->Ni", robot.configuration_D_q(q), v)
    return float(np.abs((after - before) / (2 * STEP) - along).max())


def _rate(robot: chasles.Robot, q: np.ndarray, v: np.ndarray) -> float:
    before, after = (robot.chain_rates(q + sign * STEP * v, v) for sign in (-1, 1))
    found = robot.chain_accelerations(q, v, np.zeros_like(v))
    scale = np.maximum(np.abs(found), 1.0)
    return float((np.abs((after - before) / (2 * STEP) - found) / scale).max())


def _back(robot: chasles.Robot, q: np.ndarray) -> float:
    theta = robot.chain(q)
    back = float(np.abs(robot.actuators(theta) - q).max())
    D = robot.actuators_D_chain(theta) @ robot.chain_D_q(q)
    return max(back, float(np.abs(D - np.eye(robot.n)).max()))


def _lost(robot: chasles.Robot, q: np.ndarray) -> float:
    found = robot.ik(robot.fk(q))
    apart = np.where(found.valid[..., None], np.abs(found.q - q[:, None]), np.inf).max(-1)
    return float((apart.min(-1) > BARS["back"]).sum())


def run(draws: int, first: int) -> int:
    """Judges draws and prints them; returns the exit status, 0 where all bars hold."""
    out.print(f"{draws} draws of mechanisms closed in least squares:")
    found, missed = judged_draws(judged, range(first, first + draws), BARS)
    derived = max(draw.derived for draw in found)
    out.print(f"{missed} draws miss a bar; derived within {derived:.1f} s of the processor")
    return int(missed > 0)
