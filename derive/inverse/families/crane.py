"""A rotating base, two parallel revolute joints and a telescope, as in cranes and log loaders.

One of joints 2, 3 and 4 is prismatic, and the other two are revolute with parallel axes. The
direction of the prismatic joint is perpendicular to the parallel axes. Axis 1 is perpendicular to
the parallel axes. If there is a fifth axis, it is also perpendicular to the parallel axes. The
solution steps are the same as for an arm with a rotating base and three parallel axes. The
telescope changes the length of one side of the arm triangle.

A pose has at most 4 solutions for an arm with five joints, and at most 2 for an arm with four
joints. A tool position with a pitch angle has at most 8 solutions.
"""

import numpy as np

from ..steps.plane import ARM, arm_in_plane
from ..structure.lines import Lines
from ..structure.requirement import Requirement, across, parallel, revolute
from ..tasks.tool_in_plane import WITH_DIRECTION, WITH_PITCH
from .family import Family


def _requires(lines: Lines) -> list[Requirement]:
    turning = [k for k in range(1, ARM) if lines.axes[k].turns]
    sliding = [k for k in range(1, ARM) if not lines.axes[k].turns]
    fits = len(sliding) == 1
    count = Requirement("exactly one of joints 2, 3 and 4 is prismatic", 0.0 if fits else np.inf)
    ends = [revolute(lines, [k]) for k in (0, *range(ARM, len(lines.axes)))]
    if not fits or any(end.deviation for end in ends):
        return [count, *ends]
    first = turning[0]
    return [
        *(count, *ends),
        parallel(lines, *turning),
        across(lines, sliding[0], first),
        *(across(lines, k, first) for k in (0, *range(ARM, len(lines.axes)))),
    ]


CRANE = Family(
    "a turntable with two parallel axes and a prismatic joint perpendicular to them",
    (4, 5),
    _requires,
    arm_in_plane,
    rather_gives=True,
    tasks=(WITH_PITCH, WITH_DIRECTION),
)
