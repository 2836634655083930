"""Names of robot_descriptions, from folders laid out as its own cache is."""

import importlib
import subprocess
import sys

import pytest
from typer.testing import CliRunner

from chasles.derive.cli import app

repositories = pytest.importorskip(
    "robot_descriptions._repositories", reason="the package whose names are read"
)

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
    """A cache of robot_descriptions with three small repositories; nothing can be downloaded."""
    monkeypatch.setenv("ROBOT_DESCRIPTIONS_CACHE", str(tmp_path))
    monkeypatch.setenv("ROBOT_DESCRIPTION_COMMIT", BRANCH)
    monkeypatch.setenv("GIT_CONFIG_COUNT", "1")
    monkeypatch.setenv("GIT_CONFIG_KEY_0", "url.file:///nowhere/.insteadOf")
    monkeypatch.setenv("GIT_CONFIG_VALUE_0", "https://github.com/")
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


def run(*words):
    return CliRunner().invoke(app, [*map(str, words), "--jobs", "1"])


@pytest.mark.parametrize(
    ("name", "robot"),
    [("panda", "panda"), ("ur5e_mj_description", "ur5e"), ("ur5e", "ur5e")],
)
def test_a_urdf_a_model_and_a_xacro_file(cache, name, robot):
    to = cache / "out"
    done = run(f"robot:{name}", "--to", to, "--functions", "fk")
    assert done.exit_code == 0, done.output
    assert (to / robot / "manifest.json").is_file()


def test_the_paths_are_those_of_the_package(cache):
    from chasles.derive.description.importers.named_robots import described

    module = importlib.import_module("robot_descriptions.panda_description")
    assert described("panda") == (cache.__class__(module.URDF_PATH), ())
    file, words = described("ur5e_description")
    assert (file.name, words) == ("ur.urdf.xacro", ("ur_type:=ur5e", "name:=ur5e"))


def test_unknown_and_unreachable_names(cache):
    assert "expected a name of robot_descriptions, such as panda" in run("robot:pandaa").output
    assert "expected iiwa14_description to be downloaded (" in run("robot:iiwa14").output
