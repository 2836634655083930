"""Random linkages with gears, racks and planetary stages between their joints.

The expected poses, joint values, Jacobians and accelerations are computed by a Newton iteration
that closes the loops.
"""

import tempfile
from pathlib import Path

import numpy as np

import chasles
from chasles.derive import derive
from chasles.derive.build.generate import files_of, put
from tests.support.generators.geared_linkages import geared_linkage
from tests.support.loops.geared import Errors, errors_of

from .bars import barred
from .campaign import Campaign, Outcome

POSES = 5
BARS = {
    "pose": 1e-10,
    "joints": 1e-9,
    "jacobian": 1e-7,
    "acceleration": 1e-6,
    "closure": 1e-11,
    "rates": 1e-6,
    "back": 1e-8,
    "inverse": 1e-9,
}


def trial(number: int) -> Outcome:
    found, kind = judged(number)
    return barred(kind, found, BARS, f"linkage {number}, {kind}")


def judged(number: int) -> tuple[Errors, str]:
    """Derive a random linkage, and return the errors of its functions and its family name."""
    linkage = geared_linkage(number)
    derivation = derive(linkage.mechanism)
    with tempfile.TemporaryDirectory() as folder:
        put(files_of(derivation), Path(folder))
        robot = chasles.load(folder)
        found = errors_of(robot, linkage, np.random.default_rng(number), POSES)
    closed = "" if robot.loop_solution == "closed form" else ", iterated"
    return found, f"{linkage.family}{closed}"


CAMPAIGN = Campaign(
    "geared", "Linkages with gears agree with Newton closures of their description.", trial
)
