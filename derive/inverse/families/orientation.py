"""Three revolute joints that orient the tool, as in camera heads.

The orientation determines the angles of the three joints. The axes of the three joints need not
intersect. If the first and the third axis are aligned, the tool position determines the angle of
the first joint. The residual includes the position error. Maximum number of solutions: 2.
"""

from functools import partial

from ..steps.aligned import first_angle
from ..steps.least_squares import step_on_all
from ..steps.rotations import Aligned, three_turns
from ..steps.target import Target
from ..steps.work import Work
from ..structure.lines import Lines
from ..structure.requirement import Requirement, askew, revolute
from ..tasks.partial_poses import POSITION_TASK
from .family import Family


def _requires(lines: Lines) -> list[Requirement]:
    return [revolute(lines, range(3)), askew(lines, 0, 1), askew(lines, 1, 2)]


def _solve(work: Work, lines: Lines, target: Target) -> None:
    first, second, third = lines.axes
    aligned = Aligned(partial(first_angle, work.terms, lines.axes, target))
    three_turns(work, (first, second, third), lambda v: target.turned(work.terms, v), aligned)
    step_on_all(work, lines, target)


ORIENTATION = Family(
    "three joints that orient the tool",
    (3,),
    _requires,
    _solve,
    readings=("base",),
    tasks=(POSITION_TASK,),
)
