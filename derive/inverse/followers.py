"""Inverse of a chain with mimic joints, solved as a chain with all joints free.

The solutions of the free chain include all solutions of the mimic chain. The residual is evaluated
with the mimic equations, so it marks solutions that violate them as invalid.
"""

from collections.abc import Sequence
from dataclasses import replace

from ..model.robot import SerialRobot
from ..terms.terms import Terms
from .chain_solution import solve_chain
from .classify import Classification, classify
from .families.family import Family
from .steps.target import of_pose
from .steps.work import Work
from .structure.lines import home_of
from .tasks.slots import POSE_SYMBOLS, branches, pose_argument, pose_residual, tool_of, values_of
from .tasks.task import Solved


def by_free_followers(
    robot: SerialRobot, terms: Terms, families: Sequence[Family]
) -> tuple[Classification, Solved] | None:
    """Classifies the chain with all joints free and derives the task ``ik`` of the robot.

    Args:
        robot: The description.
        terms: Table of named terms.
        families: The families to try, in order.

    Returns:
        None without mimic joints, with a non-integer mimic multiplier (whole turns are then
        ambiguous), or if the pose does not determine all free joints.
    """
    laws = [joint.mimic for joint in robot.moving if joint.mimic]
    if not laws or not all(law.multiplier.is_Integer for law in laws):
        return None
    free = replace(robot, joints=tuple(replace(joint, mimic=None) for joint in robot.joints))
    classification = classify(free, terms, families=families)
    found = classification.found
    if found is None or found.given or not found.family.solves_pose or found.family.inputs:
        return None
    work = Work(terms)
    target = of_pose(terms, POSE_SYMBOLS, home_of(free, terms))
    solve_chain(work, classification.lines, found, target, {})
    solved = zip(robot.moving, values_of(work, free, {}), strict=True)
    own = [value for joint, value in solved if joint.mimic is None]
    q = [joint.direction * value for joint, value in zip(robot.coordinates, own, strict=True)]
    pose = tool_of(terms, robot, robot.joint_values(q))
    return classification, branches(
        "ik",
        robot,
        work,
        (pose_argument(robot),),
        own,
        pose_residual(terms, pose, POSE_SYMBOLS),
        "fk(q[k]) = T wherever residual[k] is rounding",
    )
