"""Parallel revolute axes, at most three, and perhaps a slide along them: planar arms and SCARAs.

Most solutions: 2. A pose out of the plane, or of an arm with two revolute joints alone one with the
wrong angle, is answered by the nearest that these steps find.
"""

import numpy as np

from ...terms.vectors import dot, subtracted
from ..steps.target import Target
from ..steps.triangle import remaining, triangle
from ..steps.work import Work
from ..structure.lines import Lines
from ..structure.requirement import Requirement, parallel
from ..subproblems.slides import slide_to_plane
from ..subproblems.sp1 import sp1
from ..subproblems.turns import any_across

TITLE = "parallel axes"
_LEAST_TURNS, _MOST_TURNS = 2, 3


def requires(lines: Lines) -> list[Requirement]:
    """What the axes must fulfil."""
    turning = [k for k, axis in enumerate(lines.axes) if axis.turns]
    sliding = [k for k, axis in enumerate(lines.axes) if not axis.turns]
    fits = _LEAST_TURNS <= len(turning) <= _MOST_TURNS and len(sliding) <= 1
    count = Requirement("two or three revolute joints, one slide at most", 0.0 if fits else np.inf)
    return [count, parallel(lines, *turning, *sliding)] if fits else [count]


def solve(work: Work, lines: Lines, target: Target) -> None:
    """All joints for a pose."""
    terms = work.terms
    turning = tuple(axis for axis in lines.axes if axis.turns)
    first = turning[0]
    hand, meaning = target.home, "the tool's origin"
    if len(turning) == _MOST_TURNS:
        hand, meaning = turning[2].p, f"a point of axis {turning[2].name}"
    place = work.call("W", meaning, target.point(terms, hand))
    W = subtracted(terms, place, first.p)
    # 1. The slide alone moves the tool along the axes.
    for axis in lines.axes:
        if not axis.turns:
            d = dot(terms, first.h, W)
            reach = subtracted(terms, hand, first.p)
            work.slide(
                axis,
                "a line meets a plane",
                "the other joints do not move the tool along their axes",
                slide_to_plane(terms, first.h, axis.h, reach, d),
            )
    # 2, 3. A triangle.
    triangle(work, turning[0], turning[1], hand, W)
    # 4. The angles sum up to the turn of the tool.
    if len(turning) == _MOST_TURNS:
        e = any_across(terms, first.h)
        total = work.step(
            turning,
            "subproblem 1",
            "all turn the tool as one",
            sp1(terms, first.h, e, target.turned(terms, e)),
        )
        remaining(work, turning, total)
