"""Scales all lengths of a robot."""

from dataclasses import replace

import sympy as sp

from chasles.derive import SerialRobot
from chasles.derive.model.placements import Placement, Translation


def scaled(robot: SerialRobot, factor: sp.Rational, name: str) -> SerialRobot:
    """Return a serial robot with scaled placements, pitches and prismatic limits."""

    def placed(placement: Placement) -> Placement:
        return tuple(
            Translation(tuple(factor * value for value in motion.vector))
            if isinstance(motion, Translation)
            else motion
            for motion in placement
        )

    joints = tuple(
        replace(
            joint,
            before=placed(joint.before),
            after=placed(joint.after),
            pitch=factor * joint.pitch,
            limits=tuple(
                limit if limit is None or joint.kind != "prismatic" else factor * limit
                for limit in joint.limits
            ),
            convention=None,
            given=(),
        )
        for joint in robot.joints
    )
    return replace(
        robot, name=name, joints=joints, base=placed(robot.base), tool=placed(robot.tool)
    )
