"""Arms that are planar only if a fixed joint is at 0.

Three joints position the center of a spherical wrist.
"""

import numpy as np
import pytest

from tests.campaigns.losses import trial
from tests.support.generators.fixed_joints import FIXED, solved_with_fixed
from tests.support.generators.poses import PoseSet
from tests.support.oracles.verdict import judged

X, Y, Z, XY = (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0)
PLANAR = {
    "axes 1 and 2 parallel, a slide along them": [("R", Z), ("R", Z), FIXED, ("P", Y)],
    "a slide along parallel axes 2 and 3": [("P", Y), FIXED, ("R", Z), ("R", Z)],
    "axes 1 and 2 parallel": [("R", Z), ("R", Z), FIXED, ("R", Z)],
    "axes 2 and 3 parallel": [("R", Z), FIXED, ("R", Z), ("R", Z)],
    "a turn and two slides": [("R", Z), FIXED, ("P", Y), ("P", XY)],
    "a turn and two slides, one of them across": [("R", Z), ("P", Y), FIXED, ("P", Y)],
    "a turn between slides, the first across": [("P", X), ("R", Z), FIXED, ("P", Y)],
    "a turn between slides, the second across": [("P", Y), FIXED, ("R", Z), ("P", X)],
    "a turn between slides along it": [("P", Z), ("R", Z), FIXED, ("P", Z)],
    "a slide across axis 1": [("R", Z), ("P", X), FIXED, ("R", Z)],
    "a slide across axis 2": [("R", Z), FIXED, ("R", Z), ("P", Y)],
}
"""Types and axis directions of the first four joints. FIXED is the revolute joint that the argument
`fixed` names."""
EXCHANGED = [("R", Z), FIXED, ("P", Y), ("P", Z)]
"""With the fixed joint at 0 degrees, only the second prismatic joint changes the wrist height. With
the fixed joint at 90 degrees, only the first prismatic joint changes the wrist height."""
OFFSETS = [0.0, 1e-13, 1e-10, 1e-7, 1e-4]
"""Deviations (radian) of the fixed joint from the value at which the arm is planar."""
WRIST = [X, Y, X]
POSES = 200


def case_of(joints, seed):
    """Derive the inverse of an arm with random lengths, a fixed joint and a spherical wrist."""
    axes = [*joints, *(("R", axis) for axis in WRIST)]
    case = solved_with_fixed(axes, seed, meeting=len(joints))
    assert case.inverses.classification.found.family.title == "spherical wrist"
    return case


def verdict(joints, value, seed=0):
    """Count poses without solution, wrong solutions and unrecovered configurations.

    The counted solutions are not refined by iteration.
    """
    case = case_of(joints, seed)
    q = case.random(np.random.default_rng(seed), POSES)
    q[:, joints.index(FIXED)] = value
    return judged(case, PoseSet("planar", q, regular=True), case.answers)


@pytest.mark.parametrize("offset", OFFSETS)
@pytest.mark.parametrize("joints", PLANAR.values(), ids=PLANAR)
def test_every_pose_of_a_planar_arm_has_a_solution(joints, offset):
    found = verdict(joints, offset)
    assert (found.missed, found.wrong, found.lost) == (0, 0, 0)


@pytest.mark.parametrize("offset", OFFSETS)
def test_prismatic_joints_exchange_their_roles(offset):
    found = verdict(EXCHANGED, np.pi / 2 + offset)
    assert (found.missed, found.wrong, found.lost) == (0, 0, 0)


@pytest.mark.parametrize("seed", [88000183])
def test_slots_of_drawn_arm_solve_planar_poses(seed):
    outcome = trial(seed)
    assert outcome.counts["inverses"] > 0
    assert outcome.counts["losses without refinement"] == 0
