"""Where a place on a body of a mechanism is, at given values of the joints before it."""

from collections.abc import Mapping
from dataclasses import replace

import sympy as sp

from .chain import groups
from .forward import Forward, Pose
from .mechanism import Mechanism, Place
from .poe import placement_matrix
from .robot import Robot
from .scope import Scope
from .vectors import named


def pose_of(
    mechanism: Mechanism, scope: Scope, place: Place, values: Mapping[str, sp.Expr]
) -> Pose:
    """Axes and origin of a place in the base frame.

    Args:
        mechanism: The description.
        scope: Names of all terms.
        place: A frame on a body.
        values: Values of the joints between the base and the body (radian or metre).
    """
    way = mechanism.way(place.body)
    if all(joint.kind == "fixed" for joint in way):
        T = placement_matrix(mechanism.base)
        for joint in way:
            T = T * placement_matrix(joint.before) * placement_matrix(joint.after)
        T = T * placement_matrix(place.placement)
        x, y, z, p = (named(scope, T[:3, k]) for k in range(4))
        return (x, y, z), p
    robot = Robot(
        mechanism.name,
        tuple(replace(joint, parent="") for joint in way),
        base=mechanism.base,
        tool=place.placement,
        parameters=mechanism.parameters,
    )
    q = [values[joint.name] for joint in robot.coordinates]
    return Forward(scope, groups(robot, scope, robot.joint_values(q))).tool_pose()
