"""Arms as a calibration finds them: each joint a little displaced and turned from its place."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import sympy as sp

from chasles.derive import Robot, Rotation, Translation


def displaced(robot: Robot, size: float, seed: int = 0) -> Robot:
    """The robot with errors of up to `size` (metre, radian) before each joint and at the tool."""
    rng = np.random.default_rng(seed)

    def error():
        x, y, z, *angles = (sp.Rational(f"{value:.9f}") for value in rng.uniform(-size, size, 6))
        turns = (Rotation(axis, angle) for axis, angle in zip("xyz", angles, strict=True))
        return (Translation((x, y, z)), *turns)

    joints = tuple(replace(joint, before=(*joint.before, *error())) for joint in robot.joints)
    return replace(robot, joints=joints, tool=(*robot.tool, *error()), name=f"{robot.name}_true")


def pinocchio_fk(robot: Robot):
    """Forward kinematics of a serial robot by Pinocchio: q (n,) to the tool's pose (4, 4)."""
    model, parent, placed = pin.Model(), 0, _placed(robot, robot.base)
    kinds = {"revolute": pin.JointModelRZ, "prismatic": pin.JointModelPZ}
    for joint in robot.joints:
        placed = placed * _placed(robot, joint.before)
        if joint.kind != "fixed":
            assert joint.direction == 1
            parent = model.addJoint(parent, kinds[joint.kind](), placed, joint.name)
            placed = pin.SE3.Identity()
        placed = placed * _placed(robot, joint.after)
    placed = placed * _placed(robot, robot.tool)
    data = model.createData()

    def fk(q):
        pin.forwardKinematics(model, data, np.asarray(q, float))
        return (data.oMi[parent] * placed).homogeneous

    return fk


def _placed(robot: Robot, placement) -> pin.SE3:
    values = {parameter.symbol: parameter.value for parameter in robot.parameters}

    def number(value) -> float:
        return float(sp.sympify(value).subs(values))

    pose = pin.SE3.Identity()
    for motion in placement:
        if isinstance(motion, Rotation):
            axis = np.eye(3)["xyz".index(motion.axis)]
            turn = pin.AngleAxis(number(motion.angle), axis).toRotationMatrix()
            pose = pose * pin.SE3(turn, np.zeros(3))
        else:
            pose = pose * pin.SE3(np.eye(3), np.array([number(v) for v in motion.vector]))
    return pose
