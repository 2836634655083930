"""Inverse of random platforms with jointed legs and iterated loops.

Platforms have three RPS, PRS or RRS legs, or six UPS, PUS or RUS legs. Others have no ball joints:
tripteron, Exechon, 3-UPU and 3-RUU. ``fk`` of every valid solution slot is the target pose, one
slot is the generating configuration, and no slot is valid in another assembly mode.
"""

import tempfile
from pathlib import Path

import numpy as np

import chasles
from chasles.derive import Mechanism, derive
from chasles.derive.build.generate import files_of, put
from tests.support.generators.leg_platforms import LEG_KINDS, drawn_legs
from tests.support.loops.legs_of_joints import drawn, kinds_of
from tests.support.loops.slot_faults import FAULTS, slot_faults

from .campaign import Campaign, Outcome

INPUTS = 200
REACH = {"rad": 0.5, "m": 0.08}
"""Maximum difference between a coordinate and its reference value."""
EVERY = 3
"""One of so many platforms has legs without ball joints."""
FUNCTIONS = ("fk", "ik", "fk_jacobian_mixed", "chain", "margin")


def trial(number: int) -> Outcome:
    """Compares the solution slots of one platform with its forward kinematics."""
    kinds = kinds_of(number)
    mechanism = drawn(number, kinds)
    if number % EVERY == 0:
        kinds = (tuple(LEG_KINDS)[number // EVERY % len(LEG_KINDS)],)
        mechanism = drawn_legs(kinds[0], number)
    return outcome(mechanism, number, " ".join(kinds))


def outcome(mechanism: Mechanism, number: int, title: str) -> Outcome:
    """Compares the solution slots of a platform at random inputs near its reference."""
    derivation = derive(mechanism, functions=FUNCTIONS)
    with tempfile.TemporaryDirectory() as folder:
        put(files_of(derivation), Path(folder))
        robot = chasles.load(folder)
        reach = np.array([REACH[c.unit] for c in robot.coordinates])
        draw = np.random.default_rng(number).uniform(-1, 1, (INPUTS, robot.n))
        q = np.array(robot.reference.q) + reach * draw
        faults = slot_faults(robot, mechanism, q)
        counts = {
            "closed inputs": int(np.isfinite(robot.fk(q)).all((1, 2)).sum()),
            "slots": len(robot.labels["ik"]),
        }
    found = [f"{faults[kind]} {kind}" for kind in FAULTS if faults[kind]]
    return Outcome(counts, (f"{title}: {', '.join(found)}",) if found else ())


CAMPAIGN = Campaign(
    "legs",
    "Valid slots of a random platform with jointed legs agree with its forward kinematics.",
    trial,
)
