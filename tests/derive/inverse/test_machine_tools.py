"""Gantries, machine tools and planar arms with a slide: drawn robots that lose no pose."""

import random

import pytest

from bench.accuracy.losses import losses_of
from bench.cases.drawn_arms import cases_of
from chasles.derive import explain, loads

ROW = "slides in a row, and turns that the orientation determines"
PLANE = "two parallel axes and a slide across them"
POSITION = "three joints that position the tool"
DIRECTIONS = ([1, 0, 0], [0, 1, 0], [0, 0, 1], [0, -1, 0])
ACROSS = ([1, 0, 0], [0, 0, 1], [1, 0, 1], [2, 0, -1])
"""Directions across y."""
HEAD = 'name = "r"\nconvention = "urdf"\nunits = { length = "mm", angle = "deg" }\n'


def robot(kinds, directions, seed):
    """A robot of these kinds of joints, R and P, its lengths round or not."""
    draw = random.Random(seed)

    def point():
        if seed % 2:
            return [draw.choice((0, 0, 100, -200, 300)) for _ in range(3)]
        return [round(draw.uniform(-300, 300), 1) for _ in range(3)]

    lines = [f"{HEAD}tool = {{ xyz = {point()}, rpy = [90, 0, 30] }}"]
    for k, (kind, direction) in enumerate(zip(kinds, directions, strict=True)):
        name = "revolute" if kind == "R" else "prismatic"
        lines += ["[[joints]]", f'name = "j{k}"', f'type = "{name}"']
        lines += [f"xyz = {point()}", f"axis = {direction}"]
    return loads("\n".join(lines))


def lost_of(cases):
    """The sets of poses of which an inverse loses some, in words."""
    return [str(loss) for case in cases for loss in losses_of(case, 0)]


@pytest.mark.parametrize(
    "kinds", ["PP", "RP", "PR", "RR", "PPR", "RRP", "PPPR", "RPPP", "PPPRR", "RPPPR"]
)
def test_turns_come_from_the_orientation_and_slides_from_the_position(kinds):
    for seed in range(4):
        draw = random.Random(f"{kinds}{seed}")
        turns, slides = draw.sample(DIRECTIONS[:3], 3), draw.sample(DIRECTIONS[:3], 3)
        if seed > 1:
            turns, slides = [
                [[round(draw.uniform(-1, 1), 2) for _ in range(3)] for _ in range(3)]
                for _ in range(2)
            ]
        directions = [(turns if kind == "R" else slides).pop() for kind in kinds]
        cases = cases_of(robot(kinds, directions, seed))
        titles = {case.inverses.classification.found.title for case in cases}
        # Three joints that move the tool's origin everywhere position it.
        assert titles == {ROW} or (len(kinds) == 3 and titles == {POSITION})
        assert not lost_of(cases)


def test_a_head_of_three_axes_that_do_not_meet():
    directions = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 1], [0, 1, 0], [1, 0, 0]]
    (case,) = cases_of(robot("PPPRRR", directions, 0))
    assert case.inverses.classification.found.title == ROW
    assert not lost_of([case])


def test_a_machine_tool_is_commanded_by_position_and_direction():
    directions = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 1], [0, 1, 0]]
    cases = cases_of(robot("PPPRR", directions, 2))
    assert {case.function for case in cases} == {"ik", "ik_position_direction"}
    assert not lost_of(cases)


@pytest.mark.parametrize("kinds", ["RRT", "RTR", "TRR", "RLTR", "LRTR", "RTLR", "RTRL", "TRLR"])
def test_planar_arms_with_a_slide_lose_nothing(kinds):
    """T slides across the axes, and L along them."""
    for seed in range(4):
        draw = random.Random(seed)
        directions = [draw.choice(ACROSS) if kind == "T" else [0, 1, 0] for kind in kinds]
        joints = kinds.replace("L", "P").replace("T", "P")
        cases = cases_of(robot(joints, directions, seed))
        assert {case.inverses.classification.found.title for case in cases} <= {PLANE}
        assert cases or seed % 2
        assert not lost_of(cases)


def test_three_turns_need_three_slides():
    """Where the first and the third have one direction, the position would have to tell them."""
    directions = [[0, 0, 1], [0, 0, 1], [0, 1, 0], [1, 0, 0]]
    found = explain(robot("RPRR", directions, 0))
    assert found.line.startswith("no closed-form inverse")
