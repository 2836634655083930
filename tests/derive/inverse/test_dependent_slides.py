"""Inverse kinematics of arms whose prismatic directions can become linearly dependent.

If the prismatic directions are linearly dependent, many joint values reach one pose.
"""

import numpy as np
import pytest

from tests.support.generators.fixed_joints import FIXED, solved_with_fixed
from tests.support.generators.poses import PoseSet
from tests.support.oracles.verdict import judged

X, Y, Z, XY, XZ, YZ = (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (1, 0, 1), (0, 1, 1)
WRIST = [("R", X), ("R", Y), ("R", X)]
COPLANAR = [("P", X), ("P", Y), FIXED, ("P", XY)]
DEPENDENT = {
    "three slides": COPLANAR,
    "three slides, 1 and 2 parallel": [("P", Y), FIXED, ("P", Y), ("P", XZ)],
    "three slides, 1 and 3 parallel": [("P", Y), FIXED, ("P", X), ("P", Y)],
    "three slides, 2 and 3 parallel": [("P", X), ("P", Y), FIXED, ("P", Y)],
    "two slides": [("P", Y), FIXED, ("P", Y)],
    "two slides and a turn across": [("P", Y), FIXED, ("P", Y), ("R", Z)],
    "two slides and an oblique turn": [("P", YZ), FIXED, ("P", YZ), ("R", Z)],
    "two slides and a turn along": [("P", Z), FIXED, ("P", Z), ("R", Z)],
}
"""Types and axis directions of the joints before a spherical wrist, including the fixed joint
FIXED. If the fixed joint is at 0, the directions of the prismatic joints are dependent."""
OFFSETS = [0.0, 1e-16, 1e-13, 1e-10, 1e-7, 1e-4]
"""Deviations of the fixed joint from 0 (radian)."""
POSES = 100


def verdict(case, values):
    """Count missed poses, wrong solutions and lost configurations."""
    q = case.random(np.random.default_rng(0), POSES)
    for joint, value in values.items():
        q[:, joint] = value
    found = judged(case, PoseSet("dependent", q, regular=True), case.answers)
    return found.missed, found.wrong, found.lost


@pytest.mark.parametrize("offset", OFFSETS)
@pytest.mark.parametrize("joints", DEPENDENT.values(), ids=DEPENDENT)
def test_fixed_joint_makes_slides_dependent(joints, offset):
    case = solved_with_fixed([*joints, *WRIST], 0, meeting=len(joints))
    assert verdict(case, {joints.index(FIXED): offset}) == (0, 0, 0)


@pytest.mark.parametrize("offset", OFFSETS)
def test_orientation_makes_slides_dependent(offset):
    case = solved_with_fixed([("P", X), ("P", Y), ("R", X), ("P", Y)], 0)
    assert case.inverses.classification.found.given == ()
    assert verdict(case, {2: offset}) == (0, 0, 0)


@pytest.mark.parametrize("middle", [0.0, np.pi])
@pytest.mark.parametrize("before", range(4))
def test_position_determines_angles_of_aligned_axes(before, middle):
    """Aligned axes 1 and 3 leave one angle arbitrary, which moves the tool out of the plane."""
    joints = [*WRIST[:before], *COPLANAR, *WRIST[before:]]
    second = joints.index(WRIST[1])
    case = solved_with_fixed(joints, 0)
    assert verdict(case, {joints.index(FIXED): 0.0, second: middle}) == (0, 0, 0)


@pytest.mark.parametrize("offset", [0.0, 1e-9, 1e-7])
@pytest.mark.parametrize("before", range(4))
def test_nearly_aligned_axes_with_slides_that_span_space(before, offset):
    joints = [*WRIST[:before], *COPLANAR, *WRIST[before:]]
    case = solved_with_fixed(joints, 0)
    assert verdict(case, {joints.index(WRIST[1]): offset}) == (0, 0, 0)
