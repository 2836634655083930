"""Orientation task: three revolute joints give the tool a target orientation.

The rotation of the tool does not depend on the positions of the axes. Prismatic joints stay at 0,
and redundant revolute joints are fixed. The orientation task has at most two solutions.
"""

from collections.abc import Sequence
from dataclasses import replace

import sympy as sp

from ...chain.kinematics import arguments_of
from ...model.robot import SerialRobot
from ...terms.symbolic_function import Argument
from ..given_joints import without
from ..steps.rotations import three_turns
from ..steps.target import of_pose
from ..steps.work import Work
from ..structure.lines import Lines, home_of
from ..structure.requirement import askew
from .slots import POSE_SYMBOLS, branches, given_argument, pose_errors, squares, tool_of, values_of
from .task import Solved, TaskInput

NAME = "ik_orientation"
TURNS = 3
"""Number of revolute joints that determine an orientation."""
ROTATION = tuple(POSE_SYMBOLS[4 * i + j] for i in range(3) for j in range(3))
"""Symbols of the rotation entries of a pose, row by row."""


def orients(lines: Lines, given: Sequence[int]) -> bool:
    """Whether exactly three revolute joints are free and their consecutive axes are not parallel.

    Args:
        lines: The chain.
        given: Indices of the fixed joints.
    """
    left = lines.at_generic(given)
    left = replace(left, axes=tuple(axis for axis in left.axes if axis.turns))
    return len(left.axes) == TURNS and not any(askew(left, k, k + 1).deviation for k in (0, 1))


def orientation_task(robot: SerialRobot, lines: Lines, given: Sequence[int]) -> Solved:
    """Return the orientation task of a chain. ``orients`` must return True for the chain.

    Args:
        robot: The description.
        lines: Its axes.
        given: Indices of the fixed joints. In the argument list of ``ik_orientation``, the values
            of the fixed joints come after the orientation.
    """
    terms = lines.terms
    work = Work(terms)
    symbols = arguments_of([joint.unit for joint in robot.coordinates])["q"].symbols
    values = {k: robot.moving[k].direction * symbols[k] for k in given}
    target = of_pose(terms, POSE_SYMBOLS, home_of(robot, terms))
    left, target = without(lines, target, values)
    first, second, third = (axis for axis in left.axes if axis.turns)
    three_turns(work, (first, second, third), lambda v: target.turned(terms, v))
    free = tuple(axis.joint for axis in left.axes if not axis.turns)
    work.lengths |= dict.fromkeys(free, sp.S.Zero)
    meaning = f"orientation of the tool, R_{robot.base_frame}_{robot.tool_frame}"
    asked = Argument("R", ROTATION, (3, 3), "1", meaning)
    q = values_of(work, robot, values)
    _, turned = pose_errors(tool_of(terms, robot, q), POSE_SYMBOLS)
    residual = terms.let(sp.sqrt(terms.let(squares(terms, turned) / 2)))
    solved = branches(
        NAME,
        robot,
        work,
        (asked, *(given_argument(robot, k, symbols[k]) for k in given)),
        q,
        residual,
        "fk(q[k]) has the orientation R if residual[k] is a rounding error; free joints are 0",
        given,
    )
    role = replace(solved.function.role, components=("orientation",), free=free)
    return replace(
        solved,
        function=replace(solved.function, role=role),
        inputs=(TaskInput(asked, ROTATION),),
    )
