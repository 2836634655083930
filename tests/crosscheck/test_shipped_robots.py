"""Compiled robots agree with independent Pinocchio models."""

import numpy as np
import pytest

import chasles
from tests.support.tolerances import EXACT_CODE, ORACLE, ORACLE_RATES

pin = pytest.importorskip("pinocchio", reason="the oracle needs the extra `crosscheck`")

POSES = 200
P = np.pi / 2
INCH = 0.0254
FRAMES = {
    "space": pin.ReferenceFrame.WORLD,
    "body": pin.ReferenceFrame.LOCAL,
    "mixed": pin.ReferenceFrame.LOCAL_WORLD_ALIGNED,
}
# DH rows (kind, theta, d, a, alpha) of the distal convention. The joint kind "r" is revolute and
# "p" is prismatic.
DISTAL = {
    "bricklaying_planar": [
        ("r", 0, 0, 7 * INCH, 0),
        ("r", 0, 0, 5 * INCH, 0),
        ("r", 0, 0, 5 * INCH, 0),
    ],
    "ur5e": [
        ("r", 0, 0.1625, 0, P),
        ("r", 0, 0, -0.425, 0),
        ("r", 0, 0, -0.3922, 0),
        ("r", 0, 0.1333, 0, P),
        ("r", 0, 0.0997, 0, -P),
        ("r", 0, 0.0996, 0, 0),
    ],
    "puma560": [
        ("r", 0, 0.67183, 0, P),
        ("r", 0, 0, 0.4318, 0),
        ("r", 0, 0.15005, 0.0203, -P),
        ("r", 0, 0.4318, 0, P),
        ("r", 0, 0, 0, -P),
        ("r", 0, 0, 0, 0),
    ],
    "irb6640": [
        ("r", 0, 0.78, 0.32, -P),
        ("r", -P, 0, 1.075, 0),
        ("r", 0, 0, 0.2, -P),
        ("r", 0, 1.1425, 0, P),
        ("r", 0, 0, 0, -P),
        ("r", 2 * P, 0.2, 0, 0),
    ],
    "iiwa14": [
        ("r", 0, 0.36, 0, -P),
        ("r", 0, 0, 0, P),
        ("r", 0, 0.42, 0, P),
        ("r", 0, 0, 0, -P),
        ("r", 0, 0.4, 0, -P),
        ("r", 0, 0, 0, P),
        ("r", 0, 0.126, 0, 0),
    ],
    "stanford": [
        ("r", 0, 16.22 * INCH, 0, -P),
        ("r", 0, 6.05 * INCH, 0, P),
        ("p", -P, 0, 0, 0),
        ("r", 0, 0, 0, -P),
        ("r", 0, 0, 0, P),
        ("r", 0, 10.35 * INCH, 0, 0),
    ],
    "scara": [
        ("r", 0, 0.877, 0.425, 0),
        ("r", 0, 0, 0.375, np.pi),
        ("p", 0, 0, 0, 0),
        ("r", 0, 0.2, 0, 0),
    ],
    "photo_robot": [
        ("f", P, 0, 0, P),
        ("p", 0, 1.0, 0, -P),
        ("r", -P, 0.3, 0, -P),
        ("r", -P, 0, 0.333, -P),
        ("p", 0, 0.333, 0, P),
        ("r", P, 0, 0, -P),
        ("r", 0, 0.963, 0, P),
        ("r", -P, 0, 0, -P),
        ("-r", 0, 0, 0, 0),
    ],
}
# DH rows (kind, alpha, a, theta, d) of Craig's proximal convention.
PROXIMAL = {
    "lynxmotion": [
        ("r", 0, 0, 0, 0.1),
        ("r", P, 0, 0, 0),
        ("r", 0, 0.1, 0, 0),
        ("r", 0, 0.1, 0, 0),
        ("r", -P, 0, 0, 0.1),
    ],
    "panda": [
        ("r", 0, 0, 0, 0.333),
        ("r", -P, 0, 0, 0),
        ("r", P, 0, 0, 0.316),
        ("r", P, 0.0825, 0, 0),
        ("r", -P, -0.0825, 0, 0.384),
        ("r", P, 0, 0, 0),
        ("r", P, 0.088, 0, 0),
        ("f", 0, 0, -np.pi / 4, 0.107),
    ],
}
ROBOTS = [*DISTAL, *PROXIMAL]


def turn(axis, angle):
    return pin.SE3(pin.utils.rotate(axis, angle), np.zeros(3))


def shift(x, y, z):
    return pin.SE3(np.eye(3), np.array([x, y, z]))


def parts(name):
    """Return each joint's type, and the fixed transforms before and after the joint motion."""
    for kind, theta, d, a, alpha in DISTAL.get(name, ()):
        yield kind, turn("z", theta) * shift(0, 0, d), shift(a, 0, 0) * turn("x", alpha)
    for kind, alpha, a, theta, d in PROXIMAL.get(name, ()):
        before = turn("x", alpha) * shift(a, 0, 0) * turn("z", theta) * shift(0, 0, d)
        yield kind, before, pin.SE3.Identity()


def model_of(name):
    model, parent, placement = pin.Model(), 0, pin.SE3.Identity()
    joints = {"r": pin.JointModelRZ, "p": pin.JointModelPZ}
    for k, (kind, before, after) in enumerate(parts(name)):
        placement = placement * before
        if kind == "-r":
            joint = pin.JointModelRevoluteUnaligned(np.array([0.0, 0.0, -1.0]))
            parent, placement = model.addJoint(parent, joint, placement, f"j{k}"), after
        elif kind == "f":
            placement = placement * after
        else:
            parent, placement = model.addJoint(parent, joints[kind](), placement, f"j{k}"), after
    tool = pin.Frame("tool", parent, 0, placement, pin.FrameType.OP_FRAME)
    return model, model.addFrame(tool)


@pytest.mark.parametrize("name", ROBOTS)
def test_kinematics_agree_with_pinocchio(name):
    robot = chasles.load(name)
    model, tool = model_of(name)
    data = model.createData()
    rng = np.random.default_rng(7)
    q, qd, qdd = rng.uniform(-np.pi, np.pi, (3, POSES, model.nv))
    T = robot.fk(q)
    J = {frame: getattr(robot, f"jacobian_{frame}")(q) for frame in FRAMES}
    J_dot = {frame: getattr(robot, f"jacobian_{frame}_dot")(q, qd) for frame in FRAMES}
    twist = {frame: getattr(robot, f"twist_{frame}")(q, qd) for frame in FRAMES}
    A = {frame: getattr(robot, f"acceleration_{frame}")(q, qd, qdd) for frame in FRAMES}
    T_fused, J_fused = robot.fk_jacobian_mixed(q)
    worst = dict.fromkeys(("fk", "jacobian", "rate", "twist", "acceleration"), 0.0)

    def compare(what, found, expected):
        worst[what] = max(worst[what], np.abs(found - expected).max())

    for k in range(POSES):
        pin.computeJointJacobiansTimeVariation(model, data, q[k], qd[k])
        pin.updateFramePlacement(model, data, tool)
        compare("fk", T[k], data.oMf[tool].homogeneous)
        for frame, reference in FRAMES.items():
            expected = pin.getFrameJacobian(model, data, tool, reference)
            rate = pin.getFrameJacobianTimeVariation(model, data, tool, reference)
            compare("jacobian", J[frame][k], expected)
            compare("rate", J_dot[frame][k], rate)
            compare("twist", twist[frame][k], expected @ qd[k])
            compare("acceleration", A[frame][k], expected @ qdd[k] + rate @ qd[k])
    assert np.abs(T_fused - T).max() <= EXACT_CODE
    assert np.abs(J_fused - J["mixed"]).max() <= EXACT_CODE
    assert worst["fk"] <= ORACLE
    assert worst["jacobian"] <= ORACLE
    assert worst["twist"] <= ORACLE_RATES
    assert worst["rate"] <= ORACLE_RATES
    assert worst["acceleration"] <= ORACLE_RATES


def test_every_shipped_serial_robot_is_compared():
    serial = [name for name in chasles.robots() if not chasles.load(name).loops]
    # Other tests compare general arms with published numbers.
    others = {"bricklaying_gantry", "jaco2"}
    assert sorted(ROBOTS) == sorted(set(serial) - others)
