"""Runs the commands of the documentation page about imported files."""

import re
import shlex
from pathlib import Path

import pytest

from tests.support.command_line import run
from tests.support.pages import text
from tests.support.ur_files import LINKS, conf

PAGE = "reference/imports.md"
ARM = """\
<robot name="{name}"><link name="base_link"/><link name="tool0"/><link name="camera_link"/>
<joint name="turn" type="revolute"><parent link="base_link"/><child link="tool0"/>
<origin xyz="0 0 {reach}"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/></joint>
<joint name="mount" type="fixed"><parent link="tool0"/><child link="camera_link"/></joint></robot>
"""
XACRO = f"""\
<robot name="bent" xmlns:xacro="http://www.ros.org/wiki/xacro">
<xacro:arg name="reach" default="1"/>
{ARM.split(">", 1)[1].replace("{reach}", "$(arg reach)")}"""
SIDE = """\
<link name="{side}_tool0"/><joint name="{side}" type="continuous"><parent link="body"/>
<child link="{side}_tool0"/><axis xyz="0 1 0"/></joint>"""
TWO = f"""\
<robot name="duo"><link name="body"/>{SIDE.format(side="left")}{SIDE.format(side="right")}</robot>
"""
SRDF = """\
<robot name="duo"><group name="left"><chain base_link="body" tip_link="left_tool0"/></group>
<group name="right"><joint name="right"/></group></robot>
"""
MJCF = """\
<mujoco model="bar"><worldbody><body name="arm"><joint name="turn"/><geom size="0.1"/>
<site name="tcp" pos="0 0 1"/></body></worldbody></mujoco>
"""
SDF = """\
<sdf version="1.7"><model name="post"><link name="arm"/><joint name="turn" type="continuous">
<parent>world</parent><child>arm</child><axis><xyz>0 0 1</xyz></axis></joint></model></sdf>
"""
ZERO = dict.fromkeys(("theta", "d", "a", "alpha"), ", ".join("0" for _ in LINKS))
UR5E = (
    (0, 0, 0.1625, 0, 0, 0),
    (0, 0, 0, 1.5707963267948966, 0, 0),
    (-0.425, 0, 0, 0, 0, 0),
    (-0.3922, 0, 0.1333, 0, 0, 0),
    (0, -0.0997, 0, 1.5707963267948966, 0, 0),
    (0, 0.0996, 0, 1.5707963267948966, 3.141592653589793, 3.141592653589793),
)
"""Nominal frames of the UR5e, in the calibration format of the ROS driver."""


def kinematics():
    names = ("x", "y", "z", "roll", "pitch", "yaw")
    lines = ["kinematics:"]
    for link, values in zip(LINKS, UR5E, strict=True):
        lines += [f"  {link}:", *(f"    {n}: {v}" for n, v in zip(names, values, strict=True))]
    return "\n".join([*lines, "  hash: calib_1", ""])


@pytest.fixture
def files(cache, monkeypatch):
    """Create the input files for the commands on the documentation page about imported files."""
    for name, content in {
        "arm.urdf": ARM.format(name="arm", reach=1),
        "arm.urdf.xacro": XACRO,
        "two_arms.urdf": TWO,
        "two_arms.srdf": SRDF,
        "arm.xml": MJCF,
        "arm.sdf": SDF,
        "my_robot.yaml": kinematics(),
        "calibration.conf": conf(ZERO),
    }.items():
        (cache / name).write_text(content)
    monkeypatch.chdir(cache)


MADE = {
    "arm.urdf": ["arm"],
    "arm.urdf.xacro": ["bent"],
    "two_arms.urdf": ["duo_left_tool0", "duo_right_tool0"],
    "arm.xml": ["bar"],
    "arm.sdf": ["post"],
    "robot:panda": ["panda"],
    "ur5e": ["ur5e"],
}


QUICKLY = ("--functions", "fk", "--languages", "c", "--jobs", "1")


def test_commands_of_robot_files_page_run(files):
    page = text(PAGE)
    commands = re.findall(r"^chasles (derive .*)$", page, re.MULTILINE)
    assert len(commands) == 11
    for command in commands:
        words = [word.replace("robots", "made") for word in shlex.split(command)]
        done = run(*words, *QUICKLY)
        assert done.exit_code == 0, (command, done.output)
        names = MADE[words[1]]
        names = ["duo"] if words[2:4] == ["--tip", "left_tool0"] else names
        names = ["duo_left", "duo_right"] if "--srdf" in words else names
        for name in names:
            assert Path("made", name, "manifest.json").is_file(), command
    assert "tip: tool0; also there: camera_link" in page
