"""Random URDF files, and their link poses from Pinocchio's reader."""

import random
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from chasles.derive import derive, read
from chasles.derive.terms.casadi_graph import lower
from tests.support.tolerances import ORACLE

RIGHT = (
    "0",
    "1.5707963267948966",
    "-1.5707963267948966",
    "3.141592653589793",
    "0.7853981633974483",
)
AXES = ("1 0 0", "0 1 0", "0 0 1", "0 0 -1", "0.6 0 0.8", "1 2 3", "-0.57735 0.57735 0.57735")
TYPES = ("revolute", "continuous", "prismatic", "fixed")
POSES = 2


def vector(dice, digits=3):
    return " ".join(f"{dice.uniform(-1, 1):.{digits}f}" for _ in range(3))


def random_urdf(dice):
    """Return a random URDF with side branches, fixed joints and nested mimic joints."""
    count = dice.randint(2, 9)
    parts = ['<robot name="random">', '<link name="l0"/>']
    movers = []
    for k in range(1, count + 1):
        kind = dice.choice(TYPES) if k > 1 else "revolute"
        rpy = " ".join(dice.choice(RIGHT) for _ in range(3))
        rpy = rpy if dice.random() < 0.5 else vector(dice)
        mimic = ""
        if kind in ("revolute", "prismatic") and movers and dice.random() < 0.5:
            mimic = f'<mimic joint="{dice.choice(movers)}" multiplier="{dice.choice((-1, 0.5, 2))}"'
            mimic += f' offset="{dice.choice((0, 0.25, -0.1))}"/>'
        if kind in ("revolute", "continuous", "prismatic"):
            movers.append(f"j{k}")
        limit = '<limit lower="-2" upper="2" effort="1" velocity="1"/>'
        parts += [
            f'<link name="l{k}"/><link name="side{k}"/>',
            f'<joint name="j{k}" type="{kind}"><parent link="l{k - 1}"/><child link="l{k}"/>',
            f'<origin xyz="{vector(dice)}" rpy="{rpy}"/><axis xyz="{dice.choice(AXES)}"/>',
            f"{'' if kind == 'continuous' else limit}{mimic}</joint>",
            f'<joint name="s{k}" type="fixed"><parent link="l{k}"/><child link="side{k}"/></joint>',
        ]
    return "\n".join([*parts, "</robot>"]), f"l{count}"


def compare(path: Path, seed: int) -> dict[str, int]:
    """Compare the link poses of a random robot with Pinocchio's link poses.

    Args:
        path: URDF file to write.
        seed: Seed of the random robot generator.

    Returns:
        Number of joints of each type, of mimic joints and of nested mimic joints, keyed by name.
    """
    import pinocchio as pin

    dice = random.Random(seed)
    text, tip = random_urdf(dice)
    path.write_text(text)
    robot = read(path, base="l0", tip=tip, exact=True)
    joints = ElementTree.fromstring(text).findall("joint")
    followers = {
        j.get("name"): j.find("mimic").get("joint") for j in joints if j.find("mimic") is not None
    }
    seen = dict.fromkeys((*TYPES, "mimic", "mimic of a mimic"), 0)
    for kind in [*(j.get("type") for j in joints), *("mimic" for _ in followers)]:
        seen[kind] += 1
    seen["mimic of a mimic"] += sum(leader in followers for leader in followers.values())
    fk, poses = lower(derive(robot, functions=("fk", "link_poses")).functions, "r")
    model = pin.buildModelFromXML(text)
    data = model.createData()
    for _ in range(POSES):
        q = np.array([dice.uniform(-2, 2) for _ in robot.coordinates])
        names = [joint.name for joint in robot.coordinates]
        values = followed(text, dict(zip(names, q, strict=True)))
        pin.forwardKinematics(model, data, pinocchio_coordinates(model, values))
        pin.updateFramePlacements(model, data)
        links = np.array(poses(q)).reshape(-1, 4, 4)
        for name, found in zip(robot.link_names, links, strict=True):
            expected = data.oMf[model.getFrameId(name)].homogeneous
            assert np.abs(found - expected).max() <= ORACLE, (seed, name)
        tool = data.oMf[model.getFrameId(tip)].homogeneous
        assert np.abs(np.array(fk(q)).reshape(4, 4) - tool).max() <= ORACLE, seed
    return seen


def followed(text, values):
    """Return the value of every joint, including nested mimic joints, computed from the file
    itself."""
    leaders = {
        joint.get("name"): joint.find("mimic")
        for joint in ElementTree.fromstring(text).findall("joint")
        if joint.find("mimic") is not None
    }
    while missing := leaders.keys() - values.keys():
        for name in missing:
            mimic = leaders[name].attrib
            if mimic["joint"] in values:
                leader = values[mimic["joint"]]
                values[name] = float(mimic["multiplier"]) * leader + float(mimic["offset"])
    return values


def pinocchio_coordinates(model, values):
    """Return all joint coordinates for Pinocchio."""
    full = np.zeros(model.nq)
    for name, joint in zip(model.names, model.joints, strict=True):
        if name in values:
            value = values[name]
            full[joint.idx_q : joint.idx_q + joint.nq] = (
                (np.cos(value), np.sin(value)) if joint.nq == 2 else value
            )
    return full
