"""Inverse of random platforms with joints before and behind them.

``fk`` of every valid slot is the target pose, and one slot is the generating configuration.
"""

import tempfile
from pathlib import Path

import numpy as np

import chasles
from chasles.derive import derive
from chasles.derive.build.generate import files_of, put
from tests.support.generators.carried_platforms import drawn_platform
from tests.support.loops.slot_faults import FAULTS, slot_faults

from .campaign import Campaign, Outcome

INPUTS = 200
REACH = {"rad": 0.4, "m": 0.08}
"""Maximum distance of a coordinate from the reference."""
FUNCTIONS = ("fk", "ik", "chain", "margin")


def trial(number: int) -> Outcome:
    """Compares the slots of one platform with its forward kinematics."""
    mechanism = drawn_platform(number)
    derivation = derive(mechanism, functions=FUNCTIONS)
    with tempfile.TemporaryDirectory() as folder:
        put(files_of(derivation), Path(folder))
        robot = chasles.load(folder)
        reach = np.array([REACH[c.unit] for c in robot.coordinates])
        draw = np.random.default_rng(number).uniform(-1, 1, (INPUTS, robot.n))
        q = np.array(robot.reference.q) + reach * draw
        faults = slot_faults(robot, mechanism, q)
        counts = {"closed inputs": int(np.isfinite(robot.fk(q)).all((1, 2)).sum())}
    found = [f"{faults[kind]} {kind}" for kind in FAULTS if faults[kind]]
    failures = (f"{', '.join(mechanism.actuated)}: {', '.join(found)}",) if found else ()
    return Outcome(counts, failures, {})


CAMPAIGN = Campaign(
    "carried",
    "Valid slots of a platform with further joints agree with its forward kinematics.",
    trial,
)
