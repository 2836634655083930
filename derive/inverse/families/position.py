"""Three joints that position the tool: gantries, and arms without a wrist.

The orientation follows from the position. Where a pose is asked for, its position alone is met, and
the residual contains the deviation of the orientation. Most solutions: 4.
"""

from ..steps import three_joints
from ..steps.target import Target
from ..steps.work import Work
from ..structure.lines import Lines
from ..structure.requirement import Requirement
from ..tasks.partial_poses import POSITION_TASK
from .family import Family


def _requires(lines: Lines) -> list[Requirement]:
    return [three_joints.requires(lines)]


def _solve(work: Work, lines: Lines, target: Target) -> None:
    case = three_joints.case_of(lines)
    assert case is not None
    case.solve(work, lines, target.home, target.position)


# A position alone is no displacement that could be inverted, nor one from which the motion of a
# given joint could be taken out.
POSITION = Family(
    "three joints that position the tool",
    (3,),
    _requires,
    _solve,
    readings=("base",),
    behind_given=False,
    solves_pose=False,
    tasks=(POSITION_TASK,),
)
