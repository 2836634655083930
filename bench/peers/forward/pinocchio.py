"""Pinocchio, called from Python."""

import numpy as np
import pinocchio as pin

from ...cases.arms import Arm
from . import Call
from .placements import placements


def calls(arm: Arm) -> list[Call]:
    model, tool = _model(arm)
    data = model.createData()
    mixed = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    kinematics, jacobian = pin.forwardKinematics, pin.computeFrameJacobian
    placement = pin.updateFramePlacement

    def fk(q):
        kinematics(model, data, q)
        return (placement(model, data, tool),)

    def fk_jacobian(q):
        J = jacobian(model, data, q, tool, mixed)
        return placement(model, data, tool), J

    return [Call("Pinocchio", fk, fk_jacobian, _read)]


def _read(result) -> tuple[np.ndarray, ...]:
    pose, *jacobian = result
    return (pose.homogeneous, *jacobian)


def _model(arm: Arm) -> tuple[pin.Model, int]:
    *before, tool = (pin.SE3(T) for T in placements(arm))
    model, parent = pin.Model(), 0
    for k, placement in enumerate(before):
        parent = model.addJoint(parent, pin.JointModelRZ(), placement, f"j{k}")
    frame = pin.Frame("tool", parent, 0, tool, pin.FrameType.OP_FRAME)
    return model, model.addFrame(frame)
