"""Mechanisms with displaced joints, whose loops are closed in the least-squares sense.

Random errors shift every joint and loop closure by up to 0.5 mm, and rotate it by up to 2 mrad
about each axis. The computed configurations must match an independent minimization of the closure
errors with exact derivatives. The derivatives of the mechanism's functions must agree with finite
differences. ``actuators`` and ``ik`` must return the coordinates from which the configuration was
computed.
"""

import tempfile
from dataclasses import dataclass

import numpy as np

import chasles
from chasles.derive import Mechanism, read, write
from chasles.derive.model.robot import Placement
from tests.support.derivations import ROBOTS
from tests.support.generators.as_built import UPRIGHT, on_links, out_of_plane
from tests.support.oracles.least_gaps import LeastGaps
from tests.support.oracles.multi_start import Multistart

from .bars import barred
from .campaign import Campaign, Outcome

PLANES: dict[str, Placement] = {
    "board_installer": (UPRIGHT,),
    "four_bar": (),
    "slider_crank": (),
    "five_bar": (),
}
"""Rotation from the z axis to the pin axis of each robot, keyed by robot name."""
FUNCTIONS = (
    *("fk", "fk_jacobian_mixed", "configuration", "configuration_D_q", "margin"),
    *("chain", "chain_D_q", "chain_rates", "chain_accelerations"),
    *("actuators", "actuators_D_chain", "ik"),
)
C_ALONE = ("c", "python")
POSES, JUDGED = 100, 10
"""Number of configurations per mechanism, and number of configurations that are compared with a
minimization."""
STEP = 1e-6
"""Step of central differences (radian or meter)."""
BARS = {"closure": 1e-9, "slope": 1e-6, "rate": 1e-6, "back": 1e-9, "lost": 0.0, "open": 0.0}


@dataclass(frozen=True)
class Judged:
    """Error measures of a mechanism.

    Attributes:
        closure: Largest joint difference from the least-squares minimum (radian, meter).
        slope: Largest error of the derivative of the configuration with respect to the coordinates.
        rate: Largest error of the main-chain joint accelerations at random actuator velocities.
        back: Largest error of ``actuators(chain(q))`` and of its derivative, compared with q and
            the identity matrix.
        lost: Number of configurations that ``ik`` does not recover, or 0 if the test derives no
            ``ik``.
        open: Number of configurations near the reference at which the loops do not close.
    """

    closure: float
    slope: float
    rate: float
    back: float
    lost: float
    open: float


def trial(number: int) -> Outcome:
    rng = np.random.default_rng(number)
    name = str(rng.choice(list(PLANES)))
    whole = on_links(read(ROBOTS / f"{name}.toml"), PLANES[name])
    return barred(name, judged(out_of_plane(whole, rng), rng), BARS)


def judged(mechanism: Mechanism, rng: np.random.Generator) -> Judged:
    """Derive and test a mechanism at random configurations."""
    with tempfile.TemporaryDirectory() as folder:
        names = FUNCTIONS if mechanism.name == "board_installer" else FUNCTIONS[:-1]
        write(mechanism, folder, functions=names, languages=C_ALONE)
        robot = chasles.load(folder)
        q = _around(robot, rng)
        closed = robot.loops_close(q)
        open_, q = float((~closed).sum()), q[closed]
        v = rng.uniform(-1, 1, q.shape)
        return Judged(
            _from_least(robot, Multistart(mechanism), q[:JUDGED]),
            _slope(robot, q, v),
            _rate(robot, q, v),
            _back(robot, q),
            _lost(robot, q) if "ik" in names else 0.0,
            open_,
        )


def _around(robot: chasles.Robot, rng: np.random.Generator) -> np.ndarray:
    """Return random coordinates (POSES, n) that are within 0.1 limit ranges of the reference."""
    limits = np.array([(c.lower, c.upper) for c in robot.coordinates], dtype=float)
    span = np.where(np.isfinite(limits).all(-1), limits[:, 1] - limits[:, 0], np.pi)
    return robot.reference.q + 0.1 * span * rng.uniform(-1, 1, (POSES, robot.n))


def _from_least(robot: chasles.Robot, numbers: Multistart, q: np.ndarray) -> float:
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


CAMPAIGN = Campaign(
    "least_squares",
    "A displaced mechanism has the least-squares configuration, its derivatives and its inverse.",
    trial,
)
