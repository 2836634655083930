"""Xacro files and SRDF groups, and their use on the command line."""

import json
from pathlib import Path

import pytest

from chasles.derive import DescriptionError, read
from chasles.derive.description.importers.chains import chains
from chasles.derive.description.importers.xacro_file import expanded
from tests.support.command_line import run

pytest.importorskip("xacro", reason="xacro is not installed")

ARM = """\
<?xml version="1.0"?>
<!-- a robot with properties, a macro, an include and arguments -->
<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="duo">
  <xacro:arg name="reach" default="0.5"/>
  <xacro:property name="half" value="${pi/2}"/>
  <xacro:include filename="$(find arm_parts)/urdf/joint.xacro"/>
  <link name="base_link"/>
  <gazebo reference="base_link"><static>true</static></gazebo>
  <xacro:turn side="left" reach="$(arg reach)" roll="${half}"/>
  <xacro:turn side="right" reach="$(arg reach)" roll="${-half}"/>
  <transmission name="t"><joint name="left_turn"/></transmission>
</robot>
"""
JOINT = """\
<robot xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:macro name="turn" params="side reach roll">
    <link name="${side}_link">
      <visual><geometry><mesh filename="package://arm_parts/${side}.stl"/></geometry></visual>
    </link>
    <link name="${side}_tool0"/>
    <joint name="${side}_turn" type="continuous">
      <parent link="base_link"/><child link="${side}_link"/>
      <origin xyz="0 0 ${reach * 2}" rpy="${roll} 0 0"/><axis xyz="0 1 0"/>
    </joint>
    <joint name="${side}_mount" type="fixed">
      <parent link="${side}_link"/><child link="${side}_tool0"/>
    </joint>
  </xacro:macro>
</robot>
"""
SRDF = """\
<robot name="duo">
  <group name="left"><chain base_link="base_link" tip_link="left_tool0"/></group>
  <group name="right"><joint name="right_turn"/></group>
  <group name="links"><link name="left_link"/><link name="left_tool0"/></group>
  <group name="both"><group name="left"/><group name="right"/></group>
  <group name="apart"><joint name="left_turn"/><joint name="right_turn"/></group>
  <group name="gone"><joint name="no_turn"/></group>
  <group name="up"><chain base_link="left_tool0" tip_link="base_link"/></group>
  <group name="circle"><group name="circle"/></group>
  <group name="more">
    <group name="left"/><joint name="left_mount"/><joint name="right_turn"/></group>
  <group name="spare">
    <chain base_link="base_link" tip_link="left_tool0"/><joint name="right_turn"/></group>
</robot>
"""


@pytest.fixture
def arm(tmp_path):
    for path, text in {
        "duo/package.xml": "<package><name>duo</name></package>",
        "duo/urdf/duo.urdf.xacro": ARM,
        "duo/urdf/duo.srdf": SRDF,
        "parts/package.xml": "<package><name>arm_parts</name></package>",
        "parts/urdf/joint.xacro": JOINT,
    }.items():
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_text(text)
    return tmp_path / "duo/urdf/duo.urdf.xacro"


def derive(*words):
    return run("derive", *words, "--functions", "fk", "--languages", "c", "--jobs", "1")


def names(folder):
    return sorted(path.parent.name for path in Path(folder).glob("*/manifest.json"))


def test_xacro_expands_macros_properties_includes_and_arguments(arm):
    robot = read(arm, tip="left_tool0", arguments=("reach:=0.125",))
    assert robot.name == "duo"
    given = {name: str(value) for name, value in robot.joints[0].given}
    assert (given["xyz_z"], given["rpy_x"]) == ("1/4", "pi/2")


def test_each_arm_or_requested_tip_becomes_a_robot(arm, tmp_path):
    done = derive(arm, "reach:=0.25", "--to", tmp_path / "out")
    assert done.exit_code == 0, done.output
    assert names(tmp_path / "out") == ["duo_left_tool0", "duo_right_tool0"]
    said = run("explain", arm).output
    assert said.count("\nduo left_tool0\n===") == said.count("\nduo right_tool0\n===") == 1
    done = derive(arm, "--to", tmp_path / "tips", "--tip", "left_link", "--tip", "right_tool0")
    assert done.exit_code == 0, done.output
    assert names(tmp_path / "tips") == ["duo_left_link", "duo_right_tool0"]
    assert derive(arm, "--to", tmp_path / "one", "--tip", "right_link").exit_code == 0
    assert names(tmp_path / "one") == ["duo"]


def test_inferred_tip_is_reported_in_output_and_manifest(arm, tmp_path):
    done = run("explain", arm, "--base", "left_link")
    assert "expected a joint with its own coordinate" in done.output
    text = arm.read_text().replace('<xacro:turn side="right"', '<link name="camera"/><!--')
    text = text.replace(
        '"${-half}"/>',
        '--><joint name="c" type="fixed"><parent link="base_link"/><child link="camera"/></joint>',
    )
    arm.write_text(text)
    done = derive(arm, "--to", tmp_path / "out")
    assert "tip: left_tool0; also there: camera" in done.output
    notes = json.loads((tmp_path / "out/duo/manifest.json").read_text())["notes"]
    assert "tip: left_tool0; also there: camera" in notes


def test_changed_argument_or_include_triggers_derivation(arm, tmp_path):
    words = (arm, "--to", tmp_path / "out", "--tip", "left_tool0")
    assert derive(*words).exit_code == 0
    assert "nothing to derive" in derive(*words).output
    assert "1 robot written" in derive(arm, "reach:=0.3", *words[1:]).output
    part = tmp_path / "parts/urdf/joint.xacro"
    assert "1 robot written" in derive(*words).output
    part.write_text(part.read_text().replace("0 1 0", "0 0 1"))
    assert "1 robot written" in derive(*words).output


@pytest.mark.parametrize(
    ("groups", "expected"),
    [
        (("left",), [("base_link", "left_tool0", "")]),
        (("right",), [("base_link", "right_link", "")]),
        (("links",), [("base_link", "left_tool0", "")]),
        (
            ("both",),
            [("base_link", "left_tool0", "left_tool0"), ("base_link", "right_link", "right_link")],
        ),
        (
            ("left", "right"),
            [("base_link", "left_tool0", "left"), ("base_link", "right_link", "right")],
        ),
    ],
    ids=["chain", "joint", "links", "subgroups", "two groups"],
)
def test_srdf_groups_select_their_chains(arm, groups, expected):
    assert list(chains(arm, (), None, groups, None)) == expected
    elsewhere = arm.parent.parent / "moved.srdf"
    arm.with_name("duo.srdf").rename(elsewhere)
    assert list(chains(arm, (), None, groups, elsewhere)) == expected
    with pytest.raises(DescriptionError, match="or --srdf FILE"):
        chains(arm, (), None, groups, None)


def test_default_namespace_of_xacro_and_srdf_is_accepted(arm):
    files = (arm, arm.with_name("duo.srdf"))
    expected = chains(arm, (), None, ("both",), None)
    for file in files:
        text = file.read_text()
        file.write_text(text.replace("<robot ", '<robot xmlns="http://www.ros.org" ', 1))
    assert chains(arm, (), None, ("both",), None) == expected
    assert read(arm, tip="left_tool0").joints[0].name == "left_turn"


@pytest.mark.parametrize(
    ("group", "words"),
    [
        ("rigth", "one of the groups left, right, links, both, .*did you mean 'right'"),
        ("apart", ":6: <group>: expected a group whose joints are one chain, found 'apart'"),
        ("gone", "expected a joint of the robot, found 'no_turn'"),
        ("up", "expected a chain between links of the robot"),
        ("circle", "expected one of the groups"),
        ("more", "expected a joint of the chain or the groups .*, found 'right_turn'"),
        ("spare", "expected a joint of the chain or the groups .*, found 'right_turn'"),
    ],
    ids=["misspelled", "apart", "gone", "up", "circle", "more than groups", "more than a chain"],
)
def test_srdf_groups_without_a_single_chain_are_rejected(arm, group, words):
    with pytest.raises(DescriptionError, match=words):
        chains(arm, (), None, (group,), None)


def test_group_option_writes_a_robot_per_chain(arm, tmp_path):
    assert derive(arm, "--group", "both", "--to", tmp_path / "out").exit_code == 0
    assert names(tmp_path / "out") == ["duo_left_tool0", "duo_right_link"]
    both = derive(arm, "--group", "both", "--tip", "left_link", "--to", tmp_path / "x")
    assert "--group chooses base and tip" in both.output
    assert (
        "--group requires a URDF, xacro or MJCF file"
        in derive("ur5e", "--group", "arm", "--to", tmp_path / "x").output
    )


def test_group_is_read_by_name(arm):
    assert read(arm, group="left") == read(arm, base="base_link", tip="left_tool0")
    with pytest.raises(DescriptionError, match="ends at left_tool0, right_link: choose a tip"):
        read(arm, group="both")
    with pytest.raises(DescriptionError, match="either a group, or base and tip"):
        read(arm, group="left", tip="left_tool0")


@pytest.mark.parametrize(
    ("file", "old", "new", "words"),
    [
        ("arm", '<xacro:turn side="left"', '<xacro:tern side="left"', "unknown macro name"),
        ("arm", "$(find arm_parts)", "$(find arm_part)", "no package 'arm_part' in "),
        ("arm", "joint.xacro", "join.xacro", "No such file"),
        ("arm", "${pi/2}", "${py/2}", "'py' is not defined"),
        ("arm", "</robot>", "", ":13: expected xacro"),
        ("joint", "</xacro:macro>", "", "joint.xacro:15: expected xacro"),
        ("joint", "${reach * 2}", "${reach * }", "expected xacro that can be expanded"),
        ("arm", 'name="reach" default="0.5"', 'name="reach"', "missing attribute 'default'"),
        ("arm", '<xacro:arg name="reach" default="0.5"/>', "", "set reach:=value"),
    ],
    ids=[
        "macro name",
        "package",
        "include",
        "property",
        "arm not closed",
        "macro not closed",
        "expression",
        "no default",
        "no argument",
    ],
)
def test_xacro_errors_are_reported_with_their_cause(arm, file, old, new, words):
    path = arm if file == "arm" else arm.parents[2] / "parts/urdf/joint.xacro"
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(DescriptionError) as caught:
        expanded(arm, ())
    assert words in str(caught.value)


def test_misplaced_xacro_arguments_are_rejected(arm, tmp_path):
    with pytest.raises(DescriptionError, match="expected name:=value, found 'x'"):
        expanded(arm, ("x",))
    plain = tmp_path / "plain.urdf"
    plain.write_text("<robot name='x'/>")
    done = derive(plain, "a:=b", "--to", tmp_path / "out")
    assert "expected a xacro file: no other takes arguments" in done.output
    assert "expected a xacro file before its arguments" in derive("a:=b").output
    assert (
        "it applies to files that end in .urdf"
        in derive("ur5e", "a:=b", "--to", tmp_path / "o").output
    )


def test_missing_xacro_file_is_reported():
    with pytest.raises(DescriptionError, match="a readable file"):
        expanded(Path("none.xacro"), ())
