"""Robots load by name from a copy of the robot_descriptions cache."""

import importlib

import pytest

from tests.support.command_line import run

pytest.importorskip("robot_descriptions", reason="robot_descriptions is not installed")


@pytest.mark.parametrize(
    ("name", "robot"),
    [("panda", "panda"), ("ur5e_mj_description", "ur5e"), ("ur5e", "ur5e")],
)
def test_robot_names_resolve_to_urdf_mjcf_and_xacro(cache, name, robot):
    to = cache / "out"
    done = run("derive", f"robot:{name}", "--to", to, "--functions", "fk", "--jobs", 1)
    assert done.exit_code == 0, done.output
    assert (to / robot / "manifest.json").is_file()


def test_resolved_paths_match_robot_descriptions_package(cache):
    from chasles.derive.description.importers.named_robots import described

    module = importlib.import_module("robot_descriptions.panda_description")
    assert described("panda") == (cache.__class__(module.URDF_PATH), ())
    file, words = described("ur5e_description")
    assert (file.name, words) == ("ur.urdf.xacro", ("ur_type:=ur5e", "name:=ur5e"))


def test_unknown_or_unreachable_names_are_reported(cache):
    assert (
        "expected a name of robot_descriptions, such as panda"
        in run("derive", "robot:pandaa").output
    )
    assert "cannot download iiwa14_description (" in run("derive", "robot:iiwa14").output
