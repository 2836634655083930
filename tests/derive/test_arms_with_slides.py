"""Gantries, machine tools, cranes and planar arms with a prismatic joint miss no pose."""

import random

import pytest

from chasles.derive import explain, read_text
from tests.campaigns.losses import losses_of
from tests.support.generators.drawn_arms import cases_of

KINDS = {"PP": 2, "RP": 1, "RR": 2, "RRP": 1, "PPPR": 2, "RPPPR": 1}
"""Arms with decoupled joints, and their seeds.

Seed 1 gives axes along the base axes and round lengths, and seed 2 axes in any direction.
"""
MEETING = {"RRR": 2, "PRRR": 1, "RRRPP": 2}
PLANAR = {"RRT": 0, "RTR": 1, "TRR": 0, "RLTR": 0, "LRTR": 1, "TRLR": 1}
ROW = "joints that a pose determines one by one"
PLANE = "parallel axes"
POSITION = "three joints that position the tool"
DIRECTIONS = ([1, 0, 0], [0, 1, 0], [0, 0, 1], [0, -1, 0])
ACROSS = ([1, 0, 0], [0, 0, 1], [1, 0, 1], [2, 0, -1])
"""Directions normal to y."""
CRANE = "a turntable with two parallel axes and a slide across them"
BESIDE = ((1, 0, 0), (0, 0, 1), (1, 0, 1), (-1, 0, 0), (2, 0, -1), (0, 0, -1))
"""Directions normal to the parallel axes, which are along y."""
HEAD = 'name = "r"\nconvention = "urdf"\nunits = { length = "mm", angle = "deg" }\n'


def robot(kinds, directions, seed, *, meeting=False):
    """Returns a robot of joints R and P; lengths may be round, adjacent axes may intersect."""
    draw = random.Random(seed)

    def point():
        if seed % 2:
            return [draw.choice((0, 0, 100, -200, 300)) for _ in range(3)]
        return [round(draw.uniform(-300, 300), 1) for _ in range(3)]

    lines = [f"{HEAD}tool = {{ xyz = {point()}, rpy = [90, 0, 30] }}"]
    for k, (kind, direction) in enumerate(zip(kinds, directions, strict=True)):
        name = "revolute" if kind == "R" else "prismatic"
        lines += ["[[joints]]", f'name = "j{k}"', f'type = "{name}"']
        meets = meeting and kinds[:k].endswith("R") and kind == "R"
        lines += [f"xyz = {[0, 0, 0] if meets else point()}", f"axis = {direction}"]
    return read_text("\n".join(lines))


def lost_of(cases):
    """Describes the sets of poses for which an inverse misses solutions."""
    return [str(loss) for case in cases for loss in losses_of(case, 0)]


@pytest.mark.parametrize(("kinds", "seed"), KINDS.items())
def test_arms_with_decoupled_joints_solve_every_pose(kinds, seed):
    draw = random.Random(f"{kinds}{seed}")
    turns, slides = draw.sample(DIRECTIONS[:3], 3), draw.sample(DIRECTIONS[:3], 3)
    if seed > 1:
        turns, slides = [
            [[round(draw.uniform(-1, 1), 2) for _ in range(3)] for _ in range(3)] for _ in range(2)
        ]
    directions = [(turns if kind == "R" else slides).pop() for kind in kinds]
    cases = cases_of(robot(kinds, directions, seed))
    titles = {case.inverses.classification.found.title for case in cases}
    # The position of the tool point is determined by three joints that move it in all directions.
    assert titles == {ROW} or (len(kinds) == 3 and titles == {POSITION})
    assert not lost_of(cases)


def test_gantry_with_offset_three_axis_head_solves_every_pose():
    directions = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 1], [0, 1, 0], [1, 0, 0]]
    (case,) = cases_of(robot("PPPRRR", directions, 0))
    assert case.inverses.classification.found.title == ROW
    assert not lost_of([case])


@pytest.mark.parametrize(("kinds", "seed"), MEETING.items())
def test_three_meeting_axes_with_few_prismatic_joints_solve_every_pose(kinds, seed):
    draw = random.Random(f"{kinds}{seed}")
    turns, slides = draw.sample(DIRECTIONS[:3], 3), draw.sample(DIRECTIONS[:3], 3)
    if seed > 1:
        turns = [[round(draw.uniform(-1, 1), 2) for _ in range(3)] for _ in range(3)]
    directions = [(turns if kind == "R" else slides).pop() for kind in kinds]
    (case,) = cases_of(robot(kinds, directions, seed, meeting=True))
    assert case.function == "ik"
    assert not lost_of([case])


def test_five_axis_machine_has_position_and_direction_ik():
    directions = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 1], [0, 1, 0]]
    cases = cases_of(robot("PPPRR", directions, 2))
    assert {case.function for case in cases} == {"ik", "ik_position_direction"}
    assert not lost_of(cases)


@pytest.mark.parametrize(("kinds", "seed"), PLANAR.items())
def test_planar_arms_with_prismatic_joint_solve_every_pose(kinds, seed):
    """T denotes a prismatic joint normal to the revolute axes, and L a joint parallel to them."""
    draw = random.Random(seed)
    directions = [draw.choice(ACROSS) if kind == "T" else [0, 1, 0] for kind in kinds]
    joints = kinds.replace("L", "P").replace("T", "P")
    cases = cases_of(robot(joints, directions, seed))
    assert {case.inverses.classification.found.title for case in cases} <= {PLANE}
    assert cases or seed % 2
    assert not lost_of(cases)


def test_rprr_arm_has_no_closed_form_inverse():
    """If the first and third axes are parallel, the position cannot be decoupled."""
    directions = [[0, 0, 1], [0, 0, 1], [0, 1, 0], [1, 0, 0]]
    found = explain(robot("RPRR", directions, 0))
    assert found.line.startswith("no closed-form inverse")


def crane(order, *, hand, round_numbers, seed):
    """Returns an arm of random geometry, with its tool on or off the last axis."""
    draw = random.Random(seed)

    def length(share):
        if round_numbers:
            return draw.choice((0, 0, 100, 300, 500, -200))
        return round(draw.uniform(-share, share), 1)

    def point(share):
        return [length(share) for _ in range(3)]

    axes = [("slew", "revolute", (0, 0, 1))]
    for k, letter in enumerate(order):
        kind = "revolute" if letter == "R" else "prismatic"
        axes.append((f"plane_{k}", kind, (0, 1, 0) if letter == "R" else draw.choice(BESIDE)))
    if hand:
        axes.append(("hand", "revolute", draw.choice(BESIDE)))
    lines = [HEAD]
    for name, kind, axis in axes:
        lines += ["[[joints]]", f'name = "{name}"', f'type = "{kind}"']
        lines += [f"xyz = {point(500)}", f"axis = {list(axis)}"]
    on_axis = draw.random() < 0.5
    tool = f"xyz = {point(300)}" if not on_axis else "xyz = [0, 0, 0]"
    return read_text("\n".join([*lines[:1], f"tool = {{ {tool} }}", *lines[1:]]))


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
