"""Inverse kinematics of random platforms with jointed legs and iteratively closed loops.

Platforms have three RPS, PRS or RRS legs, or six UPS, PUS or RUS legs. The legs of a platform are
all of one type or of mixed types. The platforms Tripteron, Exechon, 3-UPU, 3-URU, 3-PUU and 3-RUU
have no ball joints. In platforms such as the 5-UPS/UPU, a passive chain guides the platform.
Further kinds of platforms are a Par4, a delta with a telescopic shaft, a pentapod, and an Exechon
or a Tricept with a wrist.

Valid solutions must reach the target pose in the correct assembly mode. ``fk`` must agree with
Newton's method, which follows the platform in small steps from the reference configuration.
"""

import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import chasles
from chasles.derive import Mechanism, derive
from chasles.derive.build.generate import files_of, put
from tests.support.generators.guided_platforms import GUIDED_KINDS
from tests.support.generators.leg_platforms import LEG_KINDS, drawn_as
from tests.support.generators.machine_platforms import MACHINE_KINDS
from tests.support.loops.assembly_modes import followed
from tests.support.loops.closures import Model
from tests.support.loops.legs_of_joints import FLAT, SPATIAL, drawn, kinds_of
from tests.support.loops.slot_faults import FAULTS, slot_faults

from .campaign import Campaign, Outcome

INPUTS = 200
REACH = {"rad": 0.5, "m": 0.08}
"""Maximum difference between a random coordinate and its reference value, keyed by unit."""
FOLLOWED = 20
"""Number of actuator inputs at which ``fk`` is compared with Newton's method."""
AGREE = 1e-9
"""Maximum difference between poses of ``fk`` and of Newton's method (position relative to the robot
size, rotation matrix entries)."""
KINDS = LEG_KINDS | MACHINE_KINDS | GUIDED_KINDS
EQUAL_LEGS = {f"{n}-{leg}": (leg,) * n for n, of in ((3, FLAT), (6, SPATIAL)) for leg in of}
"""Leg types of platforms whose legs are all of the same type, keyed by title."""
NAMED = (*KINDS, *EQUAL_LEGS)
Array = NDArray[np.float64]
FUNCTIONS = ("fk", "ik", "fk_jacobian_mixed", "chain", "margin")


def trial(number: int) -> Outcome:
    # Even-numbered trials draw a platform of a named kind, such as a tripteron.
    if number % 2 == 0:
        kind = NAMED[number // 2 % len(NAMED)]
        return outcome(named(kind, number), number, kind)
    kinds = kinds_of(number)
    return outcome(drawn(number, kinds), number, " ".join(kinds))


def named(kind: str, number: int) -> Mechanism:
    """Return a random platform of a kind in ``NAMED``."""
    if kind in EQUAL_LEGS:
        return drawn(number, EQUAL_LEGS[kind])
    return drawn_as(KINDS[kind], number)


def outcome(mechanism: Mechanism, number: int, title: str) -> Outcome:
    """Compare inverse solutions of a platform with its forward kinematics near the reference."""
    derivation = derive(mechanism, functions=FUNCTIONS)
    with tempfile.TemporaryDirectory() as folder:
        put(files_of(derivation), Path(folder))
        robot = chasles.load(folder)
        reach = np.array([REACH[c.unit] for c in robot.coordinates])
        draw = np.random.default_rng(number).uniform(-1, 1, (INPUTS, robot.n))
        q = np.array(robot.reference.q) + reach * draw
        faults, T = slot_faults(robot, mechanism, q), robot.fk(q)
        apart = from_newton(mechanism, q[:FOLLOWED], T[:FOLLOWED], robot.unit_length)
        counts = {
            "closed inputs": int(np.isfinite(T).all((1, 2)).sum()),
            "poses of Newton's method": len(apart),
            "slots": len(robot.labels["ik"]),
        }
    found = [f"{faults[kind]} {kind}" for kind in FAULTS if faults[kind]]
    if not counts["closed inputs"]:
        found.append("no closed input")
    worst = apart.max(initial=0.0)
    if not worst <= AGREE:
        found.append(f"{worst:.2g} from Newton's method")
    failures = (f"{title}: {', '.join(found)}",) if found else ()
    return Outcome(counts, failures, {"difference from Newton's method": worst})


def from_newton(mechanism: Mechanism, q: Array, T: Array, size: float) -> Array:
    """Return the differences between poses T (N, 4, 4) and poses that Newton's method computes.

    Singular poses are not compared. If only Newton's method finds a pose, the pose difference is
    infinite. Position differences are divided by ``size``.
    """
    model = Model(mechanism)
    z, regular = followed(model, q * model.ratio)
    apart = np.abs(model.tip(z) - T)[regular]
    apart[:, :3, 3] /= size
    return np.where(np.isnan(apart), np.inf, apart).max((-2, -1))


CAMPAIGN = Campaign(
    "legs",
    "Valid slots of a random platform with jointed legs agree with its forward kinematics.",
    trial,
)
