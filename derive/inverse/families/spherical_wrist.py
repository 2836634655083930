"""An arm with six joints, of which the last three are revolute and form a spherical wrist.

The first three joints position the wrist center (``steps.three_joints``). The wrist orients the
tool. The arm has at most twice as many solutions as its first three joints.

Source: Pieper 1968; Elias and Wen 2022, 4.1.
"""

from ..steps import three_joints
from ..steps.rotations import wrist
from ..steps.target import Target
from ..steps.two_joints import two_joints
from ..steps.work import Work
from ..steps.wrist_in_reach import with_wrist_in_reach
from ..structure.lines import Lines
from ..structure.requirement import Requirement, meeting, revolute
from ..subproblems.turns import NO_TURN
from .family import Family


def _requires(lines: Lines) -> list[Requirement]:
    return [
        revolute(lines, range(3, 6)),
        meeting(lines, 3, 4, 5),
        three_joints.requires(_arm(lines)),
    ]


def _solve(work: Work, lines: Lines, target: Target) -> None:
    terms = work.terms
    # 1 to 3. The wrist joints do not move the wrist center.
    arm = _arm(lines)
    center = lines.meeting(3, 4) if lines.axes[5].stays else lines.meeting(5, 4)
    W = work.name_vector(("W", "V"), "the wrist center", target.point(terms, center))
    first, second, third = arm.axes
    if first.stays:
        work.turns[first.joint] = NO_TURN
        two_joints(work, second, third, center, W)
    else:
        case = three_joints.case_of(arm)
        assert case is not None
        case.solve(work, arm, center, W)
    with_wrist_in_reach(work, lines, center, W, target)
    # 4 to 6. The remaining rotation.
    wrist(work, lines, 3, target)


def _arm(lines: Lines) -> Lines:
    return Lines(lines.terms, lines.axes[:3], lines.tolerance)


SPHERICAL_WRIST = Family("spherical wrist", (6,), _requires, _solve)
