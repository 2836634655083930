"""Pytest fixture that provides a small robot_descriptions cache."""

import subprocess
import sys

import pytest

BRANCH = "main"
URDF = """\
<robot name="{name}"><link name="base"/><link name="tool0"/>
<joint name="turn" type="revolute"><parent link="base"/><child link="tool0"/>
<origin xyz="0 0 0.5"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/></joint></robot>
"""
XACRO = """\
<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="$(arg name)">
<xacro:arg name="name" default="none"/><xacro:arg name="ur_type" default="none"/>
<xacro:include filename="$(find ur_description)/urdf/$(arg ur_type).xacro"/></robot>
"""
MJCF = """\
<mujoco model="ur5e"><worldbody><body name="arm" pos="0 0 0.5"><joint name="turn"/>
<geom size="0.1"/><site name="attachment_site" pos="0 0 1"/></body></worldbody></mujoco>
"""
TREES = {
    "panda_description": (
        "example-robot-data",
        {"robots/panda_description/urdf/panda.urdf": URDF.format(name="panda")},
    ),
    "ur5e_mj_description": ("mujoco_menagerie", {"universal_robots_ur5e/ur5e.xml": MJCF}),
    "ur5e_description": (
        "Universal_Robots_ROS2_Description",
        {
            "package.xml": "<package><name>ur_description</name></package>",
            "urdf/ur.urdf.xacro": XACRO,
            "urdf/ur5e.xacro": URDF.format(name="inner"),
        },
    ),
}


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """Create a robot_descriptions cache with three small repositories."""
    monkeypatch.setenv("ROBOT_DESCRIPTIONS_CACHE", str(tmp_path))
    monkeypatch.setenv("ROBOT_DESCRIPTION_COMMIT", BRANCH)
    monkeypatch.setenv("GIT_CONFIG_COUNT", "1")
    monkeypatch.setenv("GIT_CONFIG_KEY_0", "url.file:///nowhere/.insteadOf")
    monkeypatch.setenv("GIT_CONFIG_VALUE_0", "https://github.com/")
    repositories = pytest.importorskip("robot_descriptions._repositories")
    for repository, files in TREES.values():
        name = repositories.REPOSITORIES[repository].cache_path
        folder = tmp_path / f"{name}-{BRANCH}" / name
        for path, text in files.items():
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            (folder / path).write_text(text)
        for words in (
            ("init", "-q", "-b", BRANCH),
            ("add", "-A"),
            ("-c", "user.name=a", "-c", "user.email=a@b", "commit", "-qm", "files"),
        ):
            subprocess.run(["git", *words], cwd=folder, check=True)
    for name in [*TREES, "iiwa14_description"]:
        monkeypatch.delitem(sys.modules, f"robot_descriptions.{name}", raising=False)
    return tmp_path
