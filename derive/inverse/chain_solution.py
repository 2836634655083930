"""Inverse kinematics of a chain by the closed form of its arm family."""

from collections.abc import Mapping

import sympy as sp

from ..chain.kinematics import arguments_of
from ..model.robot import SerialRobot
from .classify import Attempt
from .given_joints import without
from .steps.least_squares import with_all_conditions
from .steps.target import Target, of_pose
from .steps.work import Work
from .structure.lines import Lines, home_of
from .tasks.slots import POSE_SYMBOLS, given_argument, of_pose_task
from .tasks.task import Solved


def solve_chain(
    work: Work, lines: Lines, found: Attempt, target: Target, given: Mapping[int, sp.Expr]
) -> None:
    """Solve for the free joints of a chain with the closed form of its arm family.

    Args:
        work: Object that receives the joint values and the solution steps.
        lines: The chain.
        found: The arm family that matches the axes of the chain.
        target: Target pose of the last body, relative to the pose of this body with all joints at
            zero.
        given: Values of the fixed joints (radian or meter), keyed by joint index.
    """
    left, target = without(lines, target, given)
    if found.backwards:
        found.family.solve(work, left.reversed(), target.reversed())
    else:
        found.family.solve(work, left, target)


def pose_task(robot: SerialRobot, lines: Lines, found: Attempt) -> Solved:
    """Return the inverse task ``ik``, which solves for all joints that are not fixed."""
    work = Work(lines.terms)
    symbols = arguments_of([joint.unit for joint in robot.coordinates])["q"].symbols
    arguments = tuple(given_argument(robot, k, symbols[k]) for k in found.given)
    given = {k: robot.moving[k].direction * symbols[k] for k in found.given}
    target = of_pose(lines.terms, POSE_SYMBOLS, home_of(robot, lines.terms))
    solve_chain(work, lines, found, target, given)
    with_all_conditions(work, *without(lines, target, given))
    return of_pose_task(robot, work, arguments, given, found.family.inputs)
