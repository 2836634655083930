"""The inverse of five joints as an inverse of six, where joint 6 turns the tool about its axis.

Position and direction of the tool do not depend on this sixth angle, and where the five joints
reach a pose it is 0.
"""

from collections.abc import Sequence

from ..model.robot import Robot
from .chain_solution import pose_task, solve_chain
from .classify import Classification, of_lines
from .families.family import Family
from .steps.work import Work
from .structure.lines import with_tool_axis
from .tasks.partial_poses import position_direction, target_of_direction
from .tasks.task import Solved

JOINTS = 5


def by_tool_axis(
    robot: Robot, classification: Classification, families: Sequence[Family]
) -> tuple[Classification, dict[str, Solved]] | None:
    """The structure of five joints with the tool's axis, and the tasks solved by it.

    Args:
        robot: The description.
        classification: The result for the five joints, which have no structure of their own.
        families: The families to try, in order.

    Returns:
        None where another number of joints is to be found, or no structure with the axis either.
    """
    give = classification.give
    if len(classification.lines.axes) - len(give) != JOINTS:
        return None
    lines = with_tool_axis(robot, classification.lines, stays=False)
    longer = of_lines(lines, families=families, give=give)
    if longer.found is None or longer.tier != "exact" or longer.found.given != give:
        return None
    still = with_tool_axis(robot, classification.lines, stays=True)
    solved = {"ik": pose_task(robot, still, longer.found)}
    if give:
        return longer, solved
    work = Work(lines.terms)
    solve_chain(work, lines, longer.found, target_of_direction(robot, lines.terms), {})
    solved["ik_position_direction"] = position_direction(robot, work)
    return longer, solved
