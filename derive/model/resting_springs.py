"""Replaces the springs of a robot by rigid joints."""

from dataclasses import replace

from chasles.contract import check_type

from .mechanism import Mechanism


def springs_at_rest(robot: Mechanism) -> Mechanism:
    """Replace passive joints with springs by fixed joints at the rest values of the springs.

    With fixed joints instead of stiff springs, such as the leaf springs of a leg, the loops of a
    robot can be solved without spring forces. In an MJCF model, a passive joint with a spring is a
    joint with a stiffness and no actuator.

    Args:
        robot: A robot with loops, for example from ``read``. Its attribute ``springs`` lists the
            joints with springs.

    Returns:
        The robot with fixed joints. A robot without springs is returned unchanged.

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
