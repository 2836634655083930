"""Slots of the inverse of platforms on drawn legs of joints, whose loops are iterated.

Three legs RPS, PRS or RRS, or six legs UPS, PUS or RUS. A valid slot is a pose of ``fk``, one of
them is the configuration that made the pose, and no slot is valid in another assembly mode.
"""

import tempfile
from pathlib import Path

import numpy as np

import chasles
from chasles.derive import derive
from chasles.derive.build.generate import files_of, put
from tests.support.loops.legs_of_joints import drawn, kinds_of
from tests.support.loops.slot_faults import FAULTS, slot_faults

from .campaign import Campaign, Outcome

INPUTS = 200
REACH = {"rad": 0.5, "m": 0.08}
"""Greatest distance of a coordinate from the reference."""
FUNCTIONS = ("fk", "ik", "fk_jacobian_mixed", "chain", "margin")


def trial(number: int) -> Outcome:
    """Compares the slots of one platform with its forward kinematics."""
    kinds = kinds_of(number)
    mechanism = drawn(number, kinds)
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
    failures = (f"{' '.join(kinds)}: {', '.join(found)}",) if found else ()
    return Outcome(counts, failures, {})


CAMPAIGN = Campaign(
    "legs",
    "Valid slots of a platform on drawn legs are poses of its forward kinematics.",
    trial,
)
