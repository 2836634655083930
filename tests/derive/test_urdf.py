"""URDF import: random trees against Pinocchio's own reader, and everything that can be wrong."""

import random

import numpy as np
import pytest
import sympy as sp
from tolerances import ORACLE

from chasles.derive import DescriptionError, derive, from_urdf
from chasles.derive.lower import lower

RIGHT = (
    "0",
    "1.5707963267948966",
    "-1.5707963267948966",
    "3.141592653589793",
    "0.7853981633974483",
)
AXES = ("1 0 0", "0 1 0", "0 0 1", "0 0 -1", "0.6 0 0.8", "1 2 3", "-0.57735 0.57735 0.57735")
TYPES = ("revolute", "continuous", "prismatic", "fixed")
ROBOTS, POSES = 40, 4

TWO_LINKS = """\
<robot name="two-links">
  <link name="base"/>
  <link name="arm"/>
  <link name="tool-0"/>
  <joint name="turn" type="revolute">
    <parent link="base"/>
    <child link="arm"/>
    <origin xyz="0.1 0 0.2" rpy="0 1.57079632679 0"/>
    <axis xyz="0 0 1"/>
    <limit lower="-1.5" upper="2" effort="1" velocity="1"/>
  </joint>
  <joint name="mount" type="fixed">
    <parent link="arm"/>
    <child link="tool-0"/>
    <origin xyz="0 0 0.3" rpy="0 0 1.5708"/>
  </joint>
</robot>
"""


def vector(dice, digits=3):
    return " ".join(f"{dice.uniform(-1, 1):.{digits}f}" for _ in range(3))


def random_urdf(dice):
    """A chain with side branches, fixed joints, followers of followers and axes of all kinds."""
    count = dice.randint(2, 9)
    parts = ['<robot name="random">', '<link name="l0"/>']
    movers = []
    for k in range(1, count + 1):
        kind = dice.choice(TYPES) if k > 1 else "revolute"
        rpy = " ".join(dice.choice(RIGHT) for _ in range(3))
        rpy = rpy if dice.random() < 0.5 else vector(dice)
        mimic = ""
        if kind in ("revolute", "prismatic") and movers and dice.random() < 0.3:
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


def test_random_robots_against_pinocchio(tmp_path):
    pin = pytest.importorskip("pinocchio", reason="the oracle, in the extra `crosscheck`")
    checked = 0
    for seed in range(ROBOTS):
        dice = random.Random(seed)
        text, tip = random_urdf(dice)
        path = tmp_path / f"{seed}.urdf"
        path.write_text(text)
        robot = from_urdf(path, "l0", tip)
        fk, poses = lower(derive(robot, ("fk", "link_poses")).functions, "r")
        model = pin.buildModelFromXML(text)
        data = model.createData()
        for _ in range(POSES):
            q = np.array([dice.uniform(-2, 2) for _ in robot.coordinates])
            pin.forwardKinematics(model, data, pinocchio_coordinates(model, robot, q))
            pin.updateFramePlacements(model, data)
            links = np.array(poses(q)).reshape(-1, 4, 4)
            for name, found in zip(robot.link_names, links, strict=True):
                expected = data.oMf[model.getFrameId(name)].homogeneous
                assert np.abs(found - expected).max() <= ORACLE, (seed, name)
                checked += 1
            tool = data.oMf[model.getFrameId(tip)].homogeneous
            assert np.abs(np.array(fk(q)).reshape(4, 4) - tool).max() <= ORACLE, seed
    assert checked >= ROBOTS * POSES * 2


def pinocchio_coordinates(model, robot, q):
    """All joints of the model, followers computed here, continuous ones as cosine and sine."""
    values = dict(
        zip((joint.name for joint in robot.moving), robot.joint_values(list(q)), strict=True)
    )
    full = np.zeros(model.nq)
    for name, joint in zip(model.names, model.joints, strict=True):
        if name in values:
            value = float(values[name])
            full[joint.idx_q : joint.idx_q + joint.nq] = (
                (np.cos(value), np.sin(value)) if joint.nq == 2 else value
            )
    return full


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "two.urdf"
    path.write_text(TWO_LINKS)
    return path


def test_names_limits_and_snapped_angles(path):
    robot = from_urdf(path)
    assert robot.name == "two_links"
    assert (robot.base_frame, robot.tool_frame) == ("base", "tool_0")
    assert robot.link_names == ("arm", "tool_0")
    assert robot.joints[0].limits == (sp.Rational(-3, 2), 2)
    given = dict(robot.joints[0].given)
    assert given["pitch"] == sp.pi / 2
    assert len(robot.notes) == 1
    assert "turn" in robot.notes[0]
    assert "pi/2" in robot.notes[0]
    # 1.5708 is 3.7e-6 away from a right angle: taken as it is written.
    assert dict(robot.joints[1].given)["yaw"] == sp.Rational(15708, 10000)


def wrong(path, text, *arguments):
    path.write_text(text)
    with pytest.raises(DescriptionError) as caught:
        from_urdf(path, *arguments)
    message = str(caught.value)
    assert message.startswith(str(path))
    return message


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("</robot>", "", ":18: expected well-formed XML"),
        ("<robot", "<robott", "well-formed XML"),
        ('"0 0 1"', '"0 0 0"', "zero vector"),
        ('"0 0 1"', '"0 0"', "three numbers"),
        ('"0 0 1"', '"0 0 x"', "found 'x'"),
        ('type="fixed"', 'type="floating"', "one of revolute, continuous, prismatic, fixed"),
        ('<child link="arm"/>', "", "<child link=...>"),
        ('<child link="arm"/>', '<child link="leg"/>', "found 'leg'"),
        ('<child link="arm"/>', '<child link="tool-0"/>', "no other joint carries"),
        ('lower="-1.5"', 'lower="3"', "a lower limit below the upper"),
        ('name="turn"', "", 'name="..."'),
        ("<limit", '<mimic joint="turn"/><limit', "no circle"),
        ("<limit", '<mimic joint="spin"/><limit', "found 'spin'"),
    ],
)
def test_wrong_files(path, old, new, words):
    assert words in wrong(path, TWO_LINKS.replace(old, new))


def test_wrong_links(path):
    assert "found 'tol0'" in wrong(path, TWO_LINKS, "base", "tol0")
    assert "tool-0" in wrong(path, TWO_LINKS, "base", "tol0")
    assert "a link below arm" in wrong(path, TWO_LINKS, "arm", "base")
    assert "other than the base" in wrong(path, TWO_LINKS, "base", "base")
    assert "moves by itself" in wrong(path, TWO_LINKS, "arm", "tool-0")


def test_a_circle_of_links(path):
    circle = TWO_LINKS.replace('<link name="base"/>', '<link name="base"/><link name="x"/>')
    loop = '<joint name="back" type="fixed"><parent link="tool-0"/><child link="base"/></joint>'
    message = wrong(path, circle.replace("</robot>", f"{loop}</robot>"), "x", "arm")
    assert "a link below x" in message


def test_entities_are_not_expanded(path):
    bomb = '<!DOCTYPE r [<!ENTITY a "aaaaaaaaaa">' + "".join(
        f'<!ENTITY {chr(98 + k)} "{f"&{chr(97 + k)};" * 10}">' for k in range(9)
    )
    text = f'{bomb}]>\n<robot name="&j;"><link name="base"/></robot>'
    assert "expected" in wrong(path, text)
