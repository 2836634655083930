"""Arms with four revolute joints: a base joint, two joints with parallel axes and a wrist joint.

Axes 2 and 3 are parallel. Axes 1 and 4 are not parallel to axes 2 and 3. The tool rotation consists
of three rotations, by the angles q1, q2 + q3 and q4. For an unreachable pose, the solution steps
return the joint values of a nearby pose. The residual is the distance between the reached pose and
the target pose. Maximum number of solutions: 2 for a pose, 4 for a position.
"""

import numpy as np

from ...model.robot import SerialRobot
from ...model.tolerances import TOOL_ON_AXIS
from ...terms.vectors import cross, subtracted
from ..steps.least_squares import step_on_all
from ..steps.plane import turn_to_direction
from ..steps.rotations import last_turn
from ..steps.target import Target
from ..steps.triangle import remaining
from ..steps.work import Work
from ..structure.lines import Lines, home_of, numbers
from ..structure.requirement import Requirement, askew, parallel, revolute
from ..subproblems.sp1 import sp1
from ..subproblems.turns import rotated
from ..tasks.partial_poses import POSITION_TASK
from ..tasks.task import Task
from .family import Family


def _requires(lines: Lines) -> list[Requirement]:
    return [
        revolute(lines, range(len(lines.axes))),
        parallel(lines, 1, 2),
        askew(lines, 0, 1),
        askew(lines, 2, 3),
    ]


def _solve(work: Work, lines: Lines, target: Target) -> None:
    terms, (a1, a2, a3, a4) = work.terms, lines.axes
    meaning = f"a point of axis {a4.name}"
    wanted = work.name_vector(("W", "V"), meaning, target.point(terms, a4.p))
    along = target.turned(terms, a4.h)
    # 1. The parallel joints change neither the height of the wrist along their axes nor the tilt of
    # the wrist axis.
    U, q1 = turn_to_direction(work, lines, lines.axes[1], (a4.p, wanted), (a4.h, along))
    # 2. The parallel joints 2 and 3 rotate the wrist axis, but joint 4 does not.
    seen = rotated(terms, a1.h, q1.back, along)
    q23 = work.step(
        [a2, a3],
        "subproblem 1",
        f"the parallel joints rotate axis {a4.name} together",
        sp1(terms, a2.h, a4.h, seen, is_regular=True),
    )
    # 3. The target pose determines the position of the elbow.
    fore = rotated(terms, a2.h, q23, subtracted(terms, a4.p, a3.p))
    work.step(
        [a2],
        "subproblem 1",
        f"the target pose determines the position of axis {a3.name}",
        sp1(terms, a2.h, subtracted(terms, a3.p, a2.p), subtracted(terms, U, fore)),
    )
    remaining(work, (a2, a3), q23)
    # 4. The remaining rotation.
    e = cross(terms, a4.h, a2.h)
    last_turn(work, a4, e, target.turned(terms, e), ((a1, q1), (a2, q23)))
    # 5. Near a double solution of step 1, all six pose equations together determine the joints more
    # accurately than the one equation of step 1.
    step_on_all(work, lines, target)


def _holds_tool(robot: SerialRobot, lines: Lines) -> bool:
    hand, home = lines.axes[-1], home_of(robot, lines.terms)
    lever = numbers(lines.terms, home[:3, 3]) - hand.origin
    off = float(np.linalg.norm(np.cross(hand.direction, lever)))
    return off < TOOL_ON_AXIS and POSITION_TASK.applies(robot, lines)


TURNED_HAND = Family(
    "a turntable with two parallel axes and a revolute wrist joint",
    (4,),
    _requires,
    _solve,
    readings=("base",),
    tasks=(Task(POSITION_TASK.name, POSITION_TASK.solved, _holds_tool),),
)
