"""Forward kinematics of a robot description with Pinocchio, for arms with geometric errors."""

import numpy as np
import pinocchio as pin

from chasles.derive import Rotation, SerialRobot


def pinocchio_fk(robot: SerialRobot):
    """Return a function that computes the tool pose (4, 4) at q (n,) with Pinocchio."""
    model, parent, placed = pin.Model(), 0, _placed(robot.base)
    kinds = {"revolute": pin.JointModelRZ, "prismatic": pin.JointModelPZ}
    for joint in robot.joints:
        placed = placed * _placed(joint.before)
        if joint.kind != "fixed":
            assert joint.direction == 1
            parent = model.addJoint(parent, kinds[joint.kind](), placed, joint.name)
            placed = pin.SE3.Identity()
        placed = placed * _placed(joint.after)
    placed = placed * _placed(robot.tool)
    data = model.createData()

    def fk(q):
        pin.forwardKinematics(model, data, np.asarray(q, float))
        return (data.oMi[parent] * placed).homogeneous

    return fk


def _placed(placement) -> pin.SE3:
    pose = pin.SE3.Identity()
    for motion in placement:
        if isinstance(motion, Rotation):
            axis = np.eye(3)["xyz".index(motion.axis)]
            turn = pin.AngleAxis(float(motion.angle), axis).toRotationMatrix()
            pose = pose * pin.SE3(turn, np.zeros(3))
        else:
            pose = pose * pin.SE3(np.eye(3), np.array([float(v) for v in motion.vector]))
    return pose
