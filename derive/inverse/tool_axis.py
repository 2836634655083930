"""The inverse of five joints as an inverse of six.

Joint 6 turns the tool about its axis. Position and direction of the tool do not depend on this
sixth angle, and where the five joints reach a pose it is 0. Where that gives no structure, a joint
at 0 is added whose axis gives one, for the pose alone: through the point where the last two axes
meet, or the first two, which makes a spherical wrist; through a point of an axis beside a slide,
where the wrist is spherical already; or at a distance.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import sympy as sp

from ..model.robot import SerialRobot
from ..terms.vectors import added, combination, cross
from .chain_solution import pose_task, solve_chain
from .classify import Attempt, Classification, of_lines, unfit
from .families.family import Family
from .lost_poses import lost_poses
from .steps.work import Work
from .structure.lines import ADDED_AXIS, Axis, Lines, numbers, with_tool_axis
from .structure.numeric_arm import NumericArm
from .subproblems.turns import any_across
from .tasks.partial_poses import position_direction, target_of_direction
from .tasks.task import Solved

JOINTS = 5
FEW_DECIMALS = 2


def by_tool_axis(
    robot: SerialRobot, classification: Classification, families: Sequence[Family]
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
    if len(classification.lines.axes) - len(give) != JOINTS or unfit(robot):
        return None
    lines = with_tool_axis(robot, classification.lines, stays=False)
    longer = of_lines(lines, families=families, give=give)
    if longer.found is None or longer.tier != "exact" or longer.found.given != give:
        return None if give else _by_added_axis(robot, classification, families)
    still = with_tool_axis(robot, classification.lines, stays=True)
    solved = {"ik": pose_task(robot, still, longer.found)}
    if give:
        return longer, solved
    work = Work(lines.terms)
    solve_chain(work, lines, longer.found, target_of_direction(robot, work), {})
    solved["ik_position_direction"] = position_direction(robot, work)
    return longer, solved


def with_still_axis(
    robot: SerialRobot, classification: Classification, families: Sequence[Family]
) -> tuple[Lines, Attempt] | None:
    """Five joints and a sixth at 0 that has an exact structure with them; None where none has.

    Args:
        robot: The description.
        classification: The result for the five joints, which have no structure of their own.
        families: The families to try, in order.
    """
    if len(classification.lines.axes) != JOINTS or unfit(robot):
        return None
    about_tool = with_tool_axis(robot, classification.lines, stays=True)
    for still in (about_tool, *_with_added_axis(classification.lines)):
        longer = of_lines(still, families=families)
        if longer.found is not None and longer.tier == "exact" and not longer.found.given:
            return still, longer.found
    return None


def _by_added_axis(
    robot: SerialRobot, classification: Classification, families: Sequence[Family]
) -> tuple[Classification, dict[str, Solved]] | None:
    """The same by a joint that is added at either end, for the pose alone.

    The first axis is taken that loses no pose at right angles, or the one that loses the fewest.
    """
    arm = NumericArm.of(robot, classification.lines)
    best: tuple[int, Classification, Solved] | None = None
    for still in _with_added_axis(classification.lines):
        longer = of_lines(still, families=families)
        if longer.found is None or longer.tier != "exact" or longer.found.given:
            continue
        task = pose_task(robot, still, longer.found)
        lost = lost_poses(arm, task.function)
        if best is None or lost < best[0]:
            best = lost, longer, task
        if not lost:
            break
    return None if best is None else (best[1], {"ik": best[2]})


def _with_added_axis(lines: Lines) -> Iterator[Lines]:
    """The chain with a further joint at 0 behind the last joint or before the first.

    Its axis passes through the point where the two axes at this end meet, through a point of the
    last one where a joint slides, or at a distance. At right angles to the next axis a wrist
    reaches every orientation that it can.
    """
    terms, axes, last = lines.terms, lines.axes, len(lines.axes) - 1
    size = sp.Rational(round(lines.length, FEW_DECIMALS)).limit_denominator() or sp.Integer(1)
    for end, before in ((last, last - 1), (0, 1)):
        at = axes[end]
        h = any_across(terms, at.h)
        if not (at.turns and axes[before].turns):
            points = [at.p]
        else:
            points = [lines.meeting(end, before)] if lines.meet(end, before) else []
        points.append(added(terms, at.p, combination(terms, (size,), (cross(terms, at.h, h),))))
        for p in points:
            numeric = numbers(terms, h), numbers(terms, p)
            axis = Axis(len(axes), ADDED_AXIS, "revolute", h, p, *numeric, stays=True)
            yield replace(lines, axes=(*axes, axis) if end else (axis, *axes))
