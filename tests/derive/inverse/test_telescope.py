"""Turntables with a telescope: drawn arms of each order of joints, none of whose poses is lost."""

import random

import pytest

from bench.accuracy.losses import losses_of
from bench.cases.drawn_arms import cases_of
from chasles.derive import loads

TITLE = "a turntable with two parallel axes and a slide across them"
ORDERS = ("RRP", "RPR", "PRR")
HEAD = 'name = "arm"\nconvention = "urdf"\nunits = { length = "mm", angle = "deg" }\n'
ACROSS = ((1, 0, 0), (0, 0, 1), (1, 0, 1), (-1, 0, 0), (2, 0, -1), (0, 0, -1))
"""Directions across the parallel axes, which lie along y."""


def crane(order, *, hand, round_numbers, seed):
    """An arm of a random geometry, its tool on the last axis or not."""
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
        axes.append((f"plane_{k}", kind, (0, 1, 0) if letter == "R" else draw.choice(ACROSS)))
    if hand:
        axes.append(("hand", "revolute", draw.choice(ACROSS)))
    lines = [HEAD]
    for name, kind, axis in axes:
        lines += ["[[joints]]", f'name = "{name}"', f'type = "{kind}"']
        lines += [f"xyz = {point(500)}", f"axis = {list(axis)}"]
    on_axis = draw.random() < 0.5
    tool = f"xyz = {point(300)}" if not on_axis else "xyz = [0, 0, 0]"
    return loads("\n".join([*lines[:1], f"tool = {{ {tool} }}", *lines[1:]]))


@pytest.mark.parametrize("round_numbers", [False, True])
@pytest.mark.parametrize("hand", [False, True])
@pytest.mark.parametrize("order", ORDERS)
def test_no_pose_of_a_drawn_crane_is_lost(order, hand, round_numbers):
    titles = set()
    for seed in range(3):
        cases = cases_of(crane(order, hand=hand, round_numbers=round_numbers, seed=seed))
        assert round_numbers or "ik" in {case.function for case in cases}
        titles |= {case.inverses.classification.found.title for case in cases}
        assert [str(loss) for case in cases for loss in losses_of(case, 0)] == []
    assert round_numbers or titles == {TITLE}
