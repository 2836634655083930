"""Arms with random geometric errors: small displacements and rotations of each joint."""

from dataclasses import replace

import numpy as np
import sympy as sp

from chasles.derive import Joint, Rotation, SerialRobot, Translation
from chasles.derive.model.robot import Placement


def displaced(robot: SerialRobot, size: float, seed: int = 0) -> SerialRobot:
    """Return a serial robot with errors up to `size` (meter, radian) at each joint and the tool.

    Args:
        robot: Robot without errors, whose parameters are replaced by their values.
        size: The maximum error.
        seed: Random seed.
    """
    rng = np.random.default_rng(seed)

    def error() -> Placement:
        x, y, z, *angles = (sp.Rational(f"{value:.9f}") for value in rng.uniform(-size, size, 6))
        a, b, c = angles
        return (Translation((x, y, z)), Rotation("x", a), Rotation("y", b), Rotation("z", c))

    joints = tuple(
        Joint(
            joint.name,
            joint.kind,
            before=(*_numbers(robot, joint.before), *error()),
            after=_numbers(robot, joint.after),
            limits=joint.limits,
        )
        for joint in robot.joints
    )
    base, tool = (_numbers(robot, placement) for placement in (robot.base, robot.tool))
    name, tool = f"{robot.name}_true", (*tool, *error())
    return replace(robot, joints=joints, base=base, tool=tool, name=name, parameters=())


def _numbers(robot: SerialRobot, placement: Placement) -> Placement:
    values = {parameter.symbol: parameter.value for parameter in robot.parameters}
    return tuple(
        replace(motion, angle=motion.angle.xreplace(values))
        if isinstance(motion, Rotation)
        else replace(motion, vector=tuple(v.xreplace(values) for v in motion.vector))
        for motion in placement
    )
