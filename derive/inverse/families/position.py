"""Three joints that position the tool, as in gantries and arms without a wrist.

The joints do not control the orientation of the tool. The joints move one point of the tool to its
target position. The residual includes the orientation error. The tool point that reaches its target
is the tool origin, or another point if a joint does not move the tool origin. Maximum number of
solutions: 4.
"""

import numpy as np
import sympy as sp

from ...model.robot import SerialRobot
from ...terms.terms import Terms
from ...terms.vectors import IDENTITY, Vector, combination
from ..steps import slides_between_turns, three_joints
from ..steps.target import Target, of_pose
from ..steps.work import Work
from ..structure.lines import Lines, home_of, numbers
from ..structure.rank import moves_in_space
from ..structure.requirement import Requirement
from ..tasks.partial_poses import POSITION_TASK
from ..tasks.slots import POSE_SYMBOLS, of_pose_task
from ..tasks.task import Solved, Task
from .family import Family


def _requires(lines: Lines) -> list[Requirement]:
    origin = (sp.Integer(0),) * 3
    anywhere = moves_in_space(lines, np.zeros(3)) or _moved_in_space(lines.terms, lines, origin)
    text = "the joints move a point of the tool in three directions"
    return [three_joints.requires(lines), Requirement(text, 0.0 if anywhere else np.inf)]


def _solve(work: Work, lines: Lines, target: Target) -> None:
    case = three_joints.case_of(lines)
    assert case is not None
    terms = work.terms
    home, position = target.home, target.position
    moved = _moved_in_space(terms, lines, home)
    if moved is not None:
        meaning = "a point of the tool that all joints move"
        home, position = moved, work.name_vector(("W", "V"), meaning, target.point(terms, moved))
    case.solve(work, lines, home, position)


def _moved_in_space(terms: Terms, lines: Lines, origin: Vector) -> Vector | None:
    """Return a point of the tool that can move in all three directions of space, or None.

    The returned point is about one arm length from the tool origin. If the joints already move the
    tool origin in three directions, return None.
    """
    if moves_in_space(lines, numbers(terms, origin)):
        return None
    distance = sp.Rational(f"{lines.length or 1.0:.0e}")
    for axis in IDENTITY:
        point = combination(terms, (sp.Integer(1), distance), (origin, axis))
        if moves_in_space(lines, numbers(terms, point)):
            return point
    return None


def _orientation_determines(_robot: SerialRobot, lines: Lines) -> bool:
    return all(each.deviation <= lines.tolerance for each in slides_between_turns.requires(lines))


def _whole_pose(robot: SerialRobot, lines: Lines) -> Solved:
    work = Work(lines.terms)
    target = of_pose(lines.terms, POSE_SYMBOLS, home_of(robot, lines.terms))
    slides_between_turns.solve(work, lines, target)
    return of_pose_task(robot, work, (), {})


# If the target is a pose, the axes may also be numbered from the tool to the base. For a position
# target, axes are numbered from the base. Because the motion of fixed joints cannot be removed from
# a position target, chains with fixed joints are not compared with the family POSITION.
POSITION = Family(
    "three joints that position the tool",
    (3,),
    _requires,
    _solve,
    readings=("base",),
    behind_given=False,
    solves_pose=False,
    tasks=(Task("ik", _whole_pose, _orientation_determines), POSITION_TASK),
)
