"""For gantries, machine tools, cranes and planar arms with sliders, the inverse solves every pose.

The test campaign `slides` tests further random arms with prismatic joints.
"""

import pytest

from tests.campaigns.losses import losses_of
from tests.support.generators.arms_with_slides import crane, decoupled, planar, robot
from tests.support.generators.drawn_arms import cases_of

KINDS = {"PP": 2, "RP": 1, "RR": 2, "RRP": 1, "PPPR": 2, "RPPPR": 1}
"""Random generator seed of each arm with decoupled joints, keyed by joint types.

Seed 1 generates lengths with few decimals, and joint axes that are parallel to the base axes. Seed
2 generates joint axes in any direction.
"""
MEETING = {"RRR": 2, "PRRR": 1, "RRRPP": 2}
PLANAR = {"RRT": 0, "RTR": 1, "TRR": 0, "RLTR": 0, "LRTR": 1, "TRLR": 1}
ROW = "joints that a pose determines one by one"
PLANE = "parallel axes"
POSITION = "three joints that position the tool"
CRANE = "a turntable with two parallel axes and a prismatic joint perpendicular to them"
TELESCOPIC = "a telescope and two parallel axes among joints 2, 3, 4, and intersecting axes 5, 6"


def lost_of(cases):
    """Describe the pose sets for which an inverse kinematics function misses solutions."""
    return [str(loss) for case in cases for loss in losses_of(case, 0)]


@pytest.mark.parametrize(("kinds", "seed"), KINDS.items())
def test_arms_with_decoupled_joints_solve_every_pose(kinds, seed):
    cases = cases_of(decoupled(kinds, seed))
    titles = {case.inverses.classification.found.title for case in cases}
    assert titles == {ROW} or (len(kinds) == 3 and titles == {POSITION})
    assert not lost_of(cases)


def test_gantry_with_offset_three_axis_head_solves_every_pose():
    directions = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 1], [0, 1, 0], [1, 0, 0]]
    (case,) = cases_of(robot("PPPRRR", directions, 0))
    assert case.inverses.classification.found.title == ROW
    assert not lost_of([case])


@pytest.mark.parametrize(("kinds", "seed"), MEETING.items())
def test_three_meeting_axes_with_few_prismatic_joints_solve_every_pose(kinds, seed):
    (case,) = cases_of(decoupled(kinds, seed, meeting=True))
    assert case.function == "ik"
    assert not lost_of([case])


def test_five_axis_machine_has_position_and_direction_ik():
    directions = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 1], [0, 1, 0]]
    cases = cases_of(robot("PPPRR", directions, 2))
    assert {case.function for case in cases} == {"ik", "ik_position_direction"}
    assert not lost_of(cases)


@pytest.mark.parametrize(("kinds", "seed"), PLANAR.items())
def test_planar_arms_with_prismatic_joint_solve_every_pose(kinds, seed):
    cases = cases_of(planar(kinds, seed))
    assert {case.inverses.classification.found.title for case in cases} <= {PLANE}
    assert cases or seed % 2
    assert not lost_of(cases)


@pytest.mark.parametrize("kinds", ["RPRR", "PRRR", "RRRP", "RRR"])
def test_position_determines_angles_of_aligned_axes(kinds):
    """If the axes are aligned, the orientation determines only a sum of two angles."""
    directions = iter([[0, 0, 1], [0, 1, 0], [1, 0, 0]])
    axes = [[0.6, 0, 0.8] if kind == "P" else next(directions) for kind in kinds]
    (case,) = [case for case in cases_of(robot(kinds, axes, 0)) if case.function == "ik"]
    assert not case.inverses.functions["ik"].role.searches
    assert not lost_of([case])


@pytest.mark.parametrize("kinds", ["PRP", "PRPR", "RPRP", "PRRP", "RRRP", "PRRR"])
def test_slides_between_revolute_joints_solve_every_random_pose(kinds):
    cases = [case for case in cases_of(decoupled(kinds, 2)) if case.function == "ik"]
    assert len(cases) == 1
    assert not lost_of(cases)


@pytest.mark.parametrize(
    ("order", "hand", "round_numbers"),
    [
        *(("RRP", False, False), ("RPR", True, False), ("PRR", False, True)),
    ],
)
def test_random_cranes_solve_every_pose(order, hand, round_numbers):
    cases = cases_of(crane(order, hand=hand, round_numbers=round_numbers, seed=0))
    assert round_numbers or "ik" in {case.function for case in cases}
    titles = {case.inverses.classification.found.title for case in cases}
    assert [str(loss) for case in cases for loss in losses_of(case, 0)] == []
    assert round_numbers or titles == {CRANE}


@pytest.mark.parametrize("order", ["RRP", "RPR", "PRR"])
def test_telescopic_arms_with_two_intersecting_axes_solve_every_pose(order):
    (case,) = cases_of(crane(order, hand=False, round_numbers=False, seed=1, wrist=True))
    assert case.inverses.classification.found.title == TELESCOPIC
    assert [str(loss) for loss in losses_of(case, 0)] == []
