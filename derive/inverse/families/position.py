"""Three joints that bring the tool to a place: gantries, and arms without a wrist.

The orientation is what it comes to be; of a pose, the place alone is met, and the residual tells of
the rest. Most solutions: 4.
"""

from ..steps import three_joints
from ..steps.target import Target
from ..steps.work import Work
from ..structure.lines import Lines
from ..structure.requirement import Requirement

TITLE = "three joints that place the tool"


def requires(lines: Lines) -> list[Requirement]:
    """What the axes must fulfil."""
    return [three_joints.requires(lines)]


def solve(work: Work, lines: Lines, target: Target) -> None:
    """All three joints for a target."""
    case = three_joints.case_of(lines)
    assert case is not None
    case.solve(work, lines, target.home, target.place)
