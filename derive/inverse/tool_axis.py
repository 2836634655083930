"""Solves a five-joint arm as a six-joint arm with an added joint.

The added joint 6 rotates the tool about the tool axis. The position and direction of the tool axis
do not depend on angle 6. Therefore, every reachable pose has a solution with angle 6 at 0. If the
arm with the added joint 6 belongs to no arm family, the derivation adds a different revolute joint
instead. A solution is valid only if the angle of the added joint is 0, because the real arm has no
joint at this axis. The derivation tries two positions of the added axis at each end of the arm. At
the first position, the added axis passes through the intersection of the two outermost joint axes,
as in a spherical wrist. If one of the two outermost joints is prismatic, the added axis passes
through a point of the outermost joint axis. At the second position, the added axis does not
intersect the outermost joint axis.
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
    """Solve an arm with five free joints by adding a sixth axis.

    Args:
        robot: The description.
        classification: The classification of the five joints, which fit no family.
        families: The families of axis structures to try, in order.

    Returns:
        The classification of the arm with the added axis, and the solved tasks. The function
        returns None if the number of free joints is not five, or if no added axis gives an arm that
        matches a family.
    """
    give = classification.give
    if len(classification.lines.axes) - len(give) != JOINTS or unfit(robot):
        return None
    lines = with_tool_axis(robot, classification.lines, stays=False)
    longer = of_lines(lines, families=families, give=give)
    if longer.found is None or longer.method != "exact" or longer.found.given != give:
        return None if give else _by_added_axis(robot, classification, families)
    extended = with_tool_axis(robot, classification.lines, stays=True)
    solved = {"ik": pose_task(robot, extended, longer.found)}
    if give:
        return longer, solved
    work = Work(lines.terms)
    solve_chain(work, lines, longer.found, target_of_direction(robot, work), {})
    solved["ik_position_direction"] = position_direction(robot, work)
    return longer, solved


def with_still_axis(
    robot: SerialRobot, classification: Classification, families: Sequence[Family]
) -> tuple[Lines, Attempt] | None:
    """Add a sixth joint, fixed at 0, so that the six axes exactly match an arm family.

    Return None if no sixth joint gives an arm that exactly matches a family.

    Args:
        robot: The description.
        classification: The classification of the five joints, which fit no family.
        families: The families of axis structures to try, in order.
    """
    if len(classification.lines.axes) != JOINTS or unfit(robot):
        return None
    about_tool = with_tool_axis(robot, classification.lines, stays=True)
    for extended in (about_tool, *_with_added_axis(classification.lines)):
        longer = of_lines(extended, families=families)
        if longer.found is not None and longer.method == "exact" and not longer.found.given:
            return extended, longer.found
    return None


def _by_added_axis(
    robot: SerialRobot, classification: Classification, families: Sequence[Family]
) -> tuple[Classification, dict[str, Solved]] | None:
    arm = NumericArm.of(robot, classification.lines)
    best: tuple[int, Classification, Solved] | None = None
    for extended in _with_added_axis(classification.lines):
        longer = of_lines(extended, families=families)
        if longer.found is None or longer.method != "exact" or longer.found.given:
            continue
        task = pose_task(robot, extended, longer.found)
        lost = lost_poses(arm, task.function)
        if best is None or lost < best[0]:
            best = lost, longer, task
        if not lost:
            break
    return None if best is None else (best[1], {"ik": best[2]})


def _with_added_axis(lines: Lines) -> Iterator[Lines]:
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
