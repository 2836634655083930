"""Machine tools, which consist of consecutive prismatic joints and of revolute joints.

Gantries and single joints also belong to the machine tool family. A machine tool has at most three
prismatic joints, all of them consecutive. The tool orientation determines the revolute joints. The
position error that remains after the rotations determines the prismatic joints.

A machine tool has at most two revolute joints, with two exceptions. Three revolute joints are
possible if the arm also has three prismatic joints. Three consecutive revolute joints are possible
if their axes intersect in one point. If the first and the third revolute axis become parallel, the
orientation determines only the sum of the angles of these two joints. If the first and the third
revolute axis are parallel and the arm has three prismatic joints, the tool reaches the position at
every angle of the first revolute joint. If fixed joints rotate the directions of the three
prismatic joints into one plane, the position determines the angle of the first revolute joint. Two
revolute axes, or three in an arm with three prismatic joints, need not intersect or be
perpendicular.

A pose has at most one solution, or two if the arm has three revolute joints. A tool position with a
tool direction has at most two solutions. For an unreachable pose, the solution steps return the
joint values of a nearby pose.
"""

from functools import partial
from itertools import pairwise

import numpy as np

from ...model.robot import SerialRobot
from ...model.tolerances import OBLIQUE_AXES
from ...terms.vectors import Vector, added, subtracted
from ..steps.aligned import first_angle_to_plane
from ..steps.dependent_slides import are_nearly_dependent, may_be_dependent
from ..steps.rotations import Aligned, three_turns, two_turns
from ..steps.slides import slides
from ..steps.target import Target
from ..steps.work import Work
from ..structure.lines import Lines, numbers
from ..structure.requirement import Requirement, askew, meeting
from ..subproblems.sp1 import sp1
from ..subproblems.sp2 import sp2
from ..subproblems.turns import any_across, rotated
from ..tasks.partial_poses import (
    POSITION,
    name_direction,
    position_direction,
    tool_axis,
    tool_origin,
)
from ..tasks.task import Solved, Task
from .family import Family

_MAX = 3
"""Maximum number of revolute joints, and maximum number of prismatic joints."""
_HEAD = 2
"""Number of revolute joints that orient the tool axis."""


def _requires(lines: Lines) -> list[Requirement]:
    turning = [k for k, axis in enumerate(lines.axes) if axis.turns]
    sliding = [k for k, axis in enumerate(lines.axes) if not axis.turns]
    is_head = len(turning) == _MAX and turning[-1] - turning[0] < _MAX
    most = _MAX if is_head or len(sliding) == _MAX else _HEAD
    few = len(sliding) <= _MAX and len(turning) <= most
    rule = (
        "at most two joints are revolute, or three if they are consecutive or the arm has six "
        "joints"
    )
    count = Requirement(rule, 0.0 if few else np.inf)
    one_run = not sliding or sliding[-1] - sliding[0] < len(sliding)
    run = Requirement(
        "no revolute joint is between the prismatic joints", 0.0 if one_run else np.inf
    )
    neighbours = [askew(lines, *pair) for pair in pairwise(turning)]
    center = [meeting(lines, *turning)] if is_head and len(sliding) < _MAX else []
    return [count, run, *center, *neighbours, *([_independent(lines, sliding)] if sliding else [])]


def _independent(lines: Lines, sliding: list[int]) -> Requirement:
    directions = np.array([lines.axes[k].direction for k in sliding])
    flat = np.linalg.svd(directions, compute_uv=False)[-1] < OBLIQUE_AXES
    return Requirement("the prismatic joints have independent directions", np.inf if flat else 0.0)


def _solve(work: Work, lines: Lines, target: Target) -> None:
    terms = work.terms
    # 1. The orientation.
    turning = tuple(axis for axis in lines.axes if axis.turns)
    if len(turning) == _MAX:
        _three_turns(work, lines, target)
    elif len(turning) == _HEAD:
        two_turns(work, (turning[0], turning[1]), lambda v: target.turned(terms, v))
    for axis in turning if len(turning) == 1 else ():
        e = any_across(terms, axis.h)
        found = sp1(terms, axis.h, e, target.turned(terms, e))
        work.step([axis], "subproblem 1", "only this joint rotates the tool", found)
    # 2. The position.
    _slides(work, lines, target.home, target.position)


def _three_turns(work: Work, lines: Lines, target: Target) -> None:
    terms = work.terms
    first, second, third = (axis for axis in lines.axes if axis.turns)
    directions = [axis.h for axis in lines.axes if not axis.turns]
    aligned = None
    if may_be_dependent(terms, directions):
        to_plane = partial(first_angle_to_plane, terms, lines.axes, target)
        end = (
            "is then set to 0, or follows from the position if the prismatic joints move in one "
            "plane"
        )
        aligned = Aligned(to_plane, are_nearly_dependent(terms, directions), end)
    three_turns(work, (first, second, third), lambda v: target.turned(terms, v), aligned)


def _slides(work: Work, lines: Lines, carried: Vector, position: Vector) -> None:
    terms = work.terms
    sliding = [axis for axis in lines.axes if not axis.turns]
    if not sliding:
        return
    first = lines.axes.index(sliding[0])
    for axis in reversed([axis for axis in lines.axes[first:] if axis.turns]):
        lever = subtracted(terms, carried, axis.p)
        carried = added(terms, axis.p, rotated(terms, axis.h, work.turns[axis.joint], lever))
    for axis in lines.axes[:first]:
        lever = subtracted(terms, position, axis.p)
        back = rotated(terms, axis.h, work.turns[axis.joint].back, lever)
        position = added(terms, axis.p, back)
    displacement = work.name_vector(
        ("W", "V"), "the displacement by the prismatic joints", subtracted(terms, position, carried)
    )
    slides(work, sliding, displacement, "the tool")


def _directs_tool(robot: SerialRobot, lines: Lines) -> bool:
    turning = [axis for axis in lines.axes if axis.turns]
    if (len(turning), len(lines.axes)) != (_HEAD, _HEAD + _MAX):
        return False
    axis = np.array(numbers(lines.terms, tool_axis(robot, lines.terms)))
    return float(np.linalg.norm(np.cross(turning[1].direction, axis))) > OBLIQUE_AXES


def _with_direction(robot: SerialRobot, lines: Lines) -> Solved:
    terms = lines.terms
    work = Work(terms)
    first, second = (axis for axis in lines.axes if axis.turns)
    direction = name_direction(work)
    q1, q2 = sp2(terms, first.h, second.h, tool_axis(robot, terms), direction, work.sign())
    reason = "the prismatic joints do not rotate the tool axis"
    degenerate = (
        f"if the direction is parallel to axis {first.name}, the angle is arbitrary and set to 0"
    )
    work.step([first], "subproblem 2", reason, q1, degenerate)
    reason = f"this joint produces the remaining rotation of the tool axis after {first.name}"
    work.step([second], "subproblem 1", reason, q2)
    _slides(work, lines, tool_origin(robot, terms), POSITION)
    return position_direction(robot, work)


MACHINE_TOOL = Family(
    "joints that a pose determines one by one",
    (1, 2, 3, 4, 5, 6),
    _requires,
    _solve,
    readings=("base",),
    rather_gives=True,
    tasks=(Task("ik_position_direction", _with_direction, _directs_tool),),
)
