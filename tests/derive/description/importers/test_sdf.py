"""Robots in SDF files and in robot files have the same poses."""

import json
import random

import numpy as np
import pytest

from chasles.derive import DescriptionError, Mechanism, derive, read, read_text
from chasles.derive.terms.casadi_graph import lower
from tests.support.generators.random_trees import RandomTree
from tests.support.generators.sdf_files import VARIANTS, sdf_of
from tests.support.loops.closed_in_numbers import Model
from tests.support.tolerances import ORACLE

TREES = 3
HEAD = '<sdf version="1.9"><model name="m">'
FOUR_BAR = f"""{HEAD}
<link name="crank"/>
<link name="coupler"><pose>0.2 0 0 0 0 0</pose></link>
<link name="rocker"><pose>0.5 0 0 0 0 0</pose></link>
<joint name="a" type="revolute"><parent>world</parent><child>crank</child>
  <axis><xyz>0 0 1</xyz></axis></joint>
<joint name="b" type="revolute"><parent>crank</parent><child>coupler</child>
  <axis><xyz>0 0 1</xyz><limit><effort>0</effort></limit></axis></joint>
<joint name="c" type="revolute"><parent>world</parent><child>rocker</child>
  <axis><xyz>0 0 1</xyz><limit><effort>0</effort></limit></axis></joint>
<joint name="d" type="revolute"><parent>rocker</parent><child>coupler</child>
  <pose relative_to="__model__">0.4 0.35 0 0 0 0</pose>
  <axis><xyz>0 0 1</xyz><limit><effort>0</effort></limit></axis></joint>
</model></sdf>"""
FOUR_BAR_TOML = """
name = "m"
convention = "urdf"
units = { length = "m", angle = "rad" }
actuated = ["a"]
base = { name = "world" }
tool = { name = "coupler", body = "coupler" }
joints = [
  { name = "a", parent = "world", link = "crank", axis = [0, 0, 1] },
  { name = "b", parent = "crank", link = "coupler", xyz = ["0.2", 0, 0], axis = [0, 0, 1] },
  { name = "c", parent = "world", link = "rocker", xyz = ["0.5", 0, 0], axis = [0, 0, 1] },
]
[[closures]]
name = "d"
kind = "pin"
a = { body = "rocker", xyz = ["-0.1", "0.35", 0] }
b = { body = "coupler", xyz = ["0.2", "0.35", 0] }
"""
MIMIC = f"""{HEAD}<pose>0 0 1 0 0 0</pose><link name="base"/>
<link name="one"><pose>0 0 0.5 0 0 0</pose></link><link name="two"><pose>1 0 0.5 0 0 0</pose></link>
<joint name="stand" type="fixed"><parent>world</parent><child>base</child></joint>
<joint name="lead" type="revolute"><parent>base</parent><child>one</child>
  <axis><xyz>0 1 0</xyz></axis></joint>
<joint name="follow" type="continuous"><parent>one</parent><child>two</child>
  <pose>-0.25 0 0 0 0 0</pose>
  <axis><xyz>0 0 1</xyz><mimic joint="lead" axis="axis"><multiplier>2</multiplier>
  <offset>0.3</offset><reference>0.1</reference></mimic></axis></joint>
<frame name="tool0" attached_to="two"><pose degrees="true">0.1 0 0 0 90 0</pose></frame>
</model></sdf>"""


def functions_of(robot):
    return lower(derive(robot, functions=("fk", "link_poses")).functions, "r")


def fk_of(robot):
    fk = functions_of(robot)[0]
    return lambda q: np.array(fk(q)).reshape(4, 4)


def file_of(tmp_path, text):
    path = tmp_path / "model.sdf"
    path.write_text(text)
    return path


@pytest.mark.parametrize("variant", VARIANTS)
def test_trees_have_the_poses_of_the_same_robot_file(tmp_path, variant):
    dice = random.Random(variant)
    for _ in range(TREES):
        tree = RandomTree(dice)
        base, tip = tree.ends(dice)
        (tmp_path / "tree.toml").write_text(tree.toml)
        expected = read(tmp_path / "tree.toml", base=base, tip=tip, exact=True)
        found = read(file_of(tmp_path, sdf_of(tree, variant)), base=base, tip=tip, exact=True)
        names = [joint.name for joint in expected.coordinates]
        assert [joint.name for joint in found.coordinates] == names
        fk, wanted = fk_of(found), fk_of(expected)
        for _ in range(2):
            q = np.array([dice.uniform(-2, 2) for _ in names])
            np.testing.assert_allclose(fk(q), wanted(q), atol=ORACLE, rtol=0)


def test_loops_close_by_joints_that_share_a_child(tmp_path):
    found = read(file_of(tmp_path, FOUR_BAR), tip="coupler")
    assert isinstance(found, Mechanism)
    assert (found.actuated, [c.name for c in found.closures]) == (("a",), ["d"])
    fk, wanted = fk_of(found), fk_of(read_text(FOUR_BAR_TOML))
    for a in (-0.3, 0.0, 0.4):
        np.testing.assert_allclose(fk([a]), wanted([a]), atol=ORACLE, rtol=0)


def test_mimic_in_loops_is_a_gear(tmp_path):
    """The link `hand` on the base mimics the rocker's rotation, and carries the tool."""
    extra = """<link name="hand"><pose>0.1 0.2 0 0 0 0</pose></link>
<joint name="e" type="revolute"><parent>world</parent><child>hand</child>
  <axis><xyz>0 0 1</xyz><mimic joint="c" axis="axis"><multiplier>-1.5</multiplier>
  <offset>0.3</offset><reference>0.1</reference></mimic></axis></joint></model>"""
    found = read(file_of(tmp_path, FOUR_BAR.replace("</model>", extra)), tip="hand")
    assert [coupling.joint for coupling in found.couplings] == ["e"]
    assert (found.actuated, [c.name for c in found.closures]) == (("a",), ["d"])
    fk, model = fk_of(found), Model(found)
    for a in (-0.3, 0.0, 0.4):
        u = model.followed([a])[0]
        np.testing.assert_allclose(fk([a]), model.tip([a], u), atol=1e-11, rtol=0)
        at = model.values([a], u)
        assert at["e"] == pytest.approx(0.3 - 1.5 * (at["c"] - 0.1), abs=1e-12)


@pytest.mark.parametrize(
    ("axes", "hand", "sign"),
    [
        ("<axis><xyz>0 0 1</xyz></axis>", "0 0 1", -1),
        ("<axis><xyz>0 0 1</xyz></axis><axis2><xyz>0 0 -1</xyz></axis2>", "0 0 1", 1),
        ("<axis><xyz>0 0 1</xyz></axis>", "0 0 -1", 1),
    ],
)
def test_gearbox_in_loops_is_a_gear(tmp_path, axes, hand, sign):
    """The expected tool pose comes from a numerical model, closed by Newton's method."""
    extra = f"""<link name="hand"><pose>0.1 0.2 0 0 0 0</pose></link>
<joint name="e" type="revolute"><parent>rocker</parent><child>hand</child>
  <axis><xyz>{hand}</xyz><limit><effort>0</effort></limit></axis></joint>
<joint name="gear" type="gearbox"><parent>coupler</parent><child>hand</child>{axes}
  <gearbox_reference_body>rocker</gearbox_reference_body><gearbox_ratio>2.5</gearbox_ratio></joint>
</model>"""
    text = FOUR_BAR.replace("</model>", extra)
    found = read(file_of(tmp_path, text), tip="hand")
    assert (found.actuated, [c.name for c in found.closures]) == (("a",), ["d"])
    fk, model = fk_of(found), Model(found)
    bare = Model(read(file_of(tmp_path, FOUR_BAR), tip="rocker"))
    coupler = Model(read(file_of(tmp_path, FOUR_BAR), tip="coupler"))
    for a in (-0.3, 0.0, 0.4):
        u = model.followed([a])[0]
        np.testing.assert_allclose(fk([a]), model.tip([a], u), atol=1e-11, rtol=0)
        u = bare.followed([a])[0]
        T, C = bare.tip([a], u), coupler.tip([a], u)
        one = np.arctan2(*(T[:3, :3].T @ C[:3, :3])[[1, 0], 0])
        two = sign * 2.5 * one * (1 if hand == "0 0 1" else -1)
        hand_angle = np.arctan2(*(T[:3, :3].T @ fk([a])[:3, :3])[[1, 0], 0])
        assert np.exp(1j * hand_angle) == pytest.approx(np.exp(1j * two), abs=1e-11)


def test_gearbox_of_an_arm_moves_two_joints_by_one_motor(tmp_path):
    text = f"""{HEAD}<link name="base"/><link name="one"><pose>0.2 0 0 0 0 0</pose></link>
<link name="two"><pose>0.5 0 0 0 0 0</pose></link>
<joint name="first" type="revolute"><parent>base</parent><child>one</child>
  <axis><xyz>0 0 1</xyz></axis></joint>
<joint name="second" type="revolute"><parent>one</parent><child>two</child>
  <axis><xyz>0 0 -1</xyz>{{passive}}</axis></joint>
<joint name="gear" type="gearbox"><parent>base</parent><child>two</child>
  <axis><xyz>{{axis}}</xyz></axis><gearbox_ratio>3</gearbox_ratio>
  <gearbox_reference_body>one</gearbox_reference_body></joint></model></sdf>"""
    passive = "<limit><effort>0</effort></limit>"
    robot = read(file_of(tmp_path, text.format(axis="0 0 1", passive=passive)))
    # Relative to link one, the base rotates by -first, and link two by -second.
    assert [c.name for c in robot.coordinates] == ["first"]
    (coupling,) = robot.couplings
    assert (coupling.joint, coupling.ratios) == ("second", (("first", -3),))
    with pytest.raises(DescriptionError, match="parallel to the axis of joint 'first'"):
        read(file_of(tmp_path, text.format(axis="0 1 0", passive=passive)))


PASSIVE = "<limit><effort>0</effort></limit>"
"""Limits of a joint without an actuator."""
CRANK = f"""{HEAD}
<link name="crank"/><link name="rail"><pose>0.3 0 0 0 0 0</pose></link>
<link name="rocker"><pose>0.3 0 0 0 0 0</pose></link><link name="rod"/>
<joint name="turn" type="revolute"><parent>world</parent><child>crank</child>
  <axis><xyz>0 0 1</xyz></axis></joint>
<joint name="near" type="%s"><parent>crank</parent><child>rod</child>
  <pose relative_to="__model__">0.06 0 0 0 0 0</pose>%s</joint>
<joint name="slide" type="%s"><parent>world</parent><child>rail</child>
  <axis><xyz>3 4 0</xyz>{PASSIVE}</axis></joint>
<joint name="tilt" type="revolute"><parent>rail</parent><child>rocker</child>
  <axis><xyz>1 0 0</xyz>{PASSIVE}</axis></joint>
<joint name="far" type="%s"><parent>rocker</parent><child>rod</child>
  <pose relative_to="__model__">0.3 0 0.1 0 0 0</pose>%s</joint>
</model></sdf>"""
CRANK_TOML = """
name = "m"
convention = "urdf"
units = { length = "m", angle = "deg" }
actuated = ["turn"]
base = { name = "world" }
tool = { name = "rocker", body = "rocker" }
joints = [
  { name = "turn", parent = "world", link = "crank", axis = [0, 0, 1] },
  { name = "slide", parent = "world", type = "%s", xyz = [0.3, 0, 0], axis = [3, 4, 0] },
  { name = "tilt", parent = "link2", link = "rocker", axis = [1, 0, 0] },
]
[[rods]]
name = "rod"
length = 0.26
ends = %s
a = { body = "crank", xyz = [0.06, 0, 0], rpy = %s }
b = { body = "rocker", xyz = [0, 0, 0.1] }
[reference]
%s
"""
UPRIGHT, ACROSS = (f"<xyz>{xyz}</xyz>{PASSIVE}" for xyz in ("0 0 1", "0 1 0"))
ENDS = {
    ("pin", "ball"): (
        ("revolute", f"<axis>{ACROSS}</axis>", "ball", ""),
        ("prismatic", "[-90, 0, 0]", "rod_swing = -22.6"),
    ),
    ("universal", "universal"): (
        (
            *("universal", f"<axis>{UPRIGHT}</axis><axis2>{ACROSS}</axis2>"),
            *("universal", f"<axis>{UPRIGHT}</axis><axis2>{ACROSS}</axis2>"),
        ),
        ("prismatic", "[0, 0, 0]", "rod_tilt = -22.6\nrod_far_tilt = 22.6"),
    ),
    ("universal", "ball"): (
        ("universal", f"<axis>{UPRIGHT}</axis><axis2>{ACROSS}</axis2>", "ball", ""),
        ("fixed", "[0, 0, 0]", ""),
    ),
    ("ball", "ball"): (("ball", "", "ball", ""), ("fixed", "[0, 0, 0]", "")),
}


@pytest.mark.parametrize("ends", ENDS)
def test_rods_with_two_kinds_of_joints_move_as_in_the_robot_file(tmp_path, ends):
    sdf, (rail, rpy, reference) = ENDS[ends]
    found = Model(read(file_of(tmp_path, CRANK % (*sdf[:2], rail, *sdf[2:])), tip="rocker"))
    wanted = Model(read_text(CRANK_TOML % (rail, json.dumps(ends), rpy, reference)))
    assert found.mechanism.actuated == ("turn",)
    for turn in (-0.2, 0.1):
        tips = [m.tip([turn], m.followed([turn])[0]) for m in (found, wanted)]
        np.testing.assert_allclose(tips[0], tips[1], atol=1e-10, rtol=0)


def test_ball_joint_that_carries_a_link_with_a_pin_is_an_error(tmp_path):
    text = (CRANK % ("ball", "", "fixed", "revolute", f"<axis>{ACROSS}</axis>")).replace(
        "<parent>rocker</parent><child>rod</child>", "<parent>rod</parent><child>rocker</child>"
    )
    with pytest.raises(DescriptionError, match="add another joint with the child 'rod'"):
        read(file_of(tmp_path, text), tip="rocker")


def test_mimic_frames_and_pose_of_the_model(tmp_path):
    robot = read(file_of(tmp_path, MIMIC), exact=True)
    assert (robot.base_frame, robot.tool_frame) == ("world", "tool0")
    assert [joint.name for joint in robot.coordinates] == ["lead"]
    q = 0.4
    c, s = np.cos(q), np.sin(q)
    lead = np.array([[c, 0, s, 0], [0, 1, 0, 0], [-s, 0, c, 1.5], [0, 0, 0, 1]])
    follow = 2 * (q - 0.1) + 0.3
    c, s = np.cos(follow), np.sin(follow)
    turn = np.array([[c, -s, 0, 0.75], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    tool = np.array([[0, 0, 1, 0.35], [0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 0, 1]])
    np.testing.assert_allclose(fk_of(robot)([q]), lead @ turn @ tool, atol=1e-14)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('<link name="crank"/>', "<include><uri>model://x</uri></include>", "without <include>"),
        ("</model>", '<model name="n"/></model>', "without nested models"),
        ("<parent>crank</parent>", "<parent>crunk</parent>", "a link, joint or frame of the model"),
        ('name="b" type="revolute"', 'name="b" type="screw"', "one of revolute, continuous"),
        ("<pose>0.2 0 0 0 0 0</pose>", "<pose>0.2 0 0</pose>", "x y z roll pitch yaw"),
        ("<pose>0.2 0 0 0 0 0</pose>", '<pose relative_to="b"/>', "do not refer to each other"),
        ("<xyz>0 0 1</xyz>", "<xyz>0 0 0</xyz>", "a direction"),
        ('<sdf version="1.9">', "<sdf>", ""),
        ('name="rocker"', 'name="crank"', "a name that nothing else in the model has"),
    ],
)
def test_unsupported_elements_are_errors_with_a_reason(tmp_path, old, new, words):
    path = file_of(tmp_path, FOUR_BAR.replace(old, new))
    if not words:
        assert read(path, tip="coupler")
        return
    with pytest.raises(DescriptionError, match=words):
        read(path, tip="coupler")


def test_joint_frames_away_from_the_child_are_inverted_on_the_way_up(tmp_path):
    robot = read(file_of(tmp_path, MIMIC), base="tool0", tip="world", exact=True)
    back, forth = fk_of(robot), fk_of(read(file_of(tmp_path, MIMIC), exact=True))
    np.testing.assert_allclose(back([0.4]) @ forth([0.4]), np.eye(4), atol=1e-14)
