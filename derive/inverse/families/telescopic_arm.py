"""A telescopic arm with two parallel axes and a prismatic joint. Axes 5 and 6 intersect.

Joint 1 is revolute. One of joints 2 to 4 is prismatic and perpendicular to the parallel axes of the
other two joints. An example of a telescopic arm is an Exechon with a head, which consists of a
universal joint, a telescope and three revolute joints. Maximum number of solutions: 8.
"""

import numpy as np

from ..steps.parallel_slides import telescope
from ..steps.plane import turn_to_plane
from ..steps.rotations import two_last_turns
from ..steps.target import Target
from ..steps.triangle import remaining
from ..steps.work import Work
from ..structure.lines import Lines
from ..structure.requirement import Requirement, across, meeting, parallel, revolute
from ..subproblems.sp2 import sp2
from ..subproblems.turns import rotated
from .family import Family

_ARM = (1, 2, 3)
"""Indices of joints 2 to 4, which move in one plane."""


def _requires(lines: Lines) -> list[Requirement]:
    pair = [k for k in _ARM if lines.axes[k].turns]
    slides = [k for k in _ARM if k not in pair]
    count = Requirement(
        "exactly one of joints 2, 3 and 4 is prismatic", 0.0 if len(slides) == 1 else np.inf
    )
    others = [k for k in range(len(lines.axes)) if k not in slides]
    if len(slides) != 1:
        return [count]
    return [
        count,
        revolute(lines, others),
        parallel(lines, *pair),
        across(lines, slides[0], pair[0]),
        meeting(lines, 4, 5),
    ]


def _solve(work: Work, lines: Lines, target: Target) -> None:
    terms = work.terms
    a1, *arm, a5, a6 = lines.axes
    pair = tuple(axis for axis in arm if axis.turns)
    second, center = pair[0], lines.meeting(5, 4)

    # 1. Joints 5 and 6 do not move the intersection of their axes. Joints 2 to 4 move the
    # intersection of axes 5 and 6 perpendicular to the parallel axes.
    meaning = "the common point of axes 5 and 6"
    wanted = work.name_vector(("W", "V"), meaning, target.point(terms, center))
    reason = f"only this joint moves the common point of axes 5 and 6 along axis {second.name}"
    U, q1 = turn_to_plane(work, a1, second, center, wanted, reason)

    # 2. Joint 6 does not rotate its own axis.
    v = rotated(terms, a1.h, q1.back, target.turned(terms, a6.h))
    found, _ = sp2(terms, second.h, a5.h, a6.h, v, work.sign())
    total = work.step(
        pair,
        "subproblem 2",
        f"joint 6 does not rotate its own axis, and {pair[0].name} and {pair[1].name} rotate it "
        "together",
        found,
        f"if axis 6 is parallel to axis {second.name}, the sum is arbitrary and set to 0",
    )

    # 3 and 4. The remaining rotation.
    regular = found.margin is None
    two_last_turns(work, ((a1, q1), (second, total)), (a5, a6), target, is_regular=regular)

    # 5. The prismatic joint sets the length of one side of a triangle.
    telescope(work, tuple(arm), center, U, total)
    remaining(work, pair, total)


TELESCOPIC_ARM = Family(
    "a telescope and two parallel axes among joints 2, 3, 4, and intersecting axes 5, 6",
    (6,),
    _requires,
    _solve,
    rather_gives=True,
)
