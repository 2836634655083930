"""Replaces the springs of a robot by rigid joints."""

from dataclasses import replace

from chasles.contract import check_type

from .mechanism import Mechanism


def springs_at_rest(robot: Mechanism) -> Mechanism:
    """Return a robot whose passive joints with springs are rigid.

    In an MJCF model, passive joints with springs have a stiffness and no actuator. The rigid joints
    keep the values at which the springs exert no torque. Therefore, loops with stiff springs, such
    as the leaf springs of a leg, are solved without spring forces.

    Args:
        robot: A robot with loops.

    Raises:
        InputTypeError: The robot is not a ``Mechanism``.
    """
    check_type("springs_at_rest: robot", robot, Mechanism)
    rest = dict(robot.springs)
    joints = tuple(
        joint.fixed_at(joint.direction * rest[joint.name]) if joint.name in rest else joint
        for joint in robot.joints
    )
    written = robot.as_written
    return replace(
        robot,
        joints=joints,
        reference=tuple(pair for pair in robot.reference if pair[0] not in rest),
        springs=(),
        as_written=None if written is None else springs_at_rest(written),
    )
