"""Hints about units and missing solutions on the command line."""

import json
import math
import re

import numpy as np
import pytest

import chasles
from tests.support.command_line import run

LYNX = ("ik", "lynxmotion", "--xyz", "0.1,0.1,0.2")
DEGREES = "angles without a unit are in radians; for degrees: "


@pytest.mark.parametrize("task", ["position_pitch", "position_direction"])
def test_task_of_the_inverse_leaves_rotations_free(task):
    arm = chasles.load("lynxmotion")
    T = arm.fk([0.3, 1.1, -1.2, -0.4, 0.9])
    rpy, xyz = chasles.se3.to_rpy(T), T[:3, 3]
    words = [*("--xyz", ",".join(map(repr, xyz.tolist())), "--task", task, "--json")]
    done = run("ik", "lynxmotion", *words, "--rpy", ",".join(map(repr, rpy.tolist())))
    assert done.exit_code == 0, done.output
    for one in json.loads(done.stdout)["solutions"]:
        pose = arm.fk(one["q"])
        np.testing.assert_allclose(pose[:3, 3], xyz, atol=1e-9)
        np.testing.assert_allclose(pose[2, 2], T[2, 2], atol=1e-9)
        if task == "position_direction":
            np.testing.assert_allclose(pose[:3, 2], T[:3, 2], atol=1e-9)


def test_every_task_of_a_robot_is_an_option():
    for name in ("lynxmotion", "five_bar", "ur5e"):
        for task in chasles.load(name).manifest.inverses:
            done = run("ik", name, "--xyz", "0.1,0.1,0", "--rpy", "0,0,0", "--task", task)
            assert done.stderr == ""
    done = run(*LYNX, "--task", "planar", "--rpy", "0,0,0")
    assert "no closed form for --task planar; with a closed form: --task pose" in done.stderr
    assert "--numeric solves" in run(*LYNX, "--task", "planar", "--numeric").stderr


def test_direction_is_solved_by_iteration():
    arm = chasles.load("lynxmotion")
    T = arm.fk([0.3, 1.1, -1.2, -0.4, 0.9])
    words = ("--xyz", ",".join(map(repr, T[:3, 3].tolist())), "--numeric", "--json", "--rpy")
    rpy = ",".join(map(repr, chasles.se3.to_rpy(T @ chasles.se3.pose(rpy=[0, 0, 1])).tolist()))
    done = run("ik", "lynxmotion", *words, rpy, "--task", "position_direction")
    (solution,) = json.loads(done.stdout)["solutions"]
    np.testing.assert_allclose(arm.fk(solution["q"])[:3, 2:], T[:3, 2:], atol=1e-8)


def test_only_the_orientation_is_out_of_reach():
    done = run(*LYNX, "--rpy", "180deg,0,20deg")
    assert done.exit_code == 1
    assert done.stdout.startswith("lynxmotion: no solution (orientation out of reach; ")
    last = done.stdout.splitlines()[-1]
    assert last.startswith("the position is within reach with other orientations: --task position")
    tasks = re.findall(r"--task (\w+)", last)
    for task in tasks:
        assert "no solution" not in run(*LYNX, "--rpy", "180deg,0,20deg", "--task", task).stdout
    far = run("ik", "lynxmotion", "--xyz", "3,0,0.2", "--rpy", "0,0,0").stdout
    assert far.startswith("lynxmotion: no solution (out of reach; ")
    assert "within reach" not in far


def test_angles_above_a_turn_without_unit_get_a_hint_at_degrees():
    pose = ("ik", "ur5e", "--xyz", "0.3,0.1,0.5", "--rpy")
    assert f"{DEGREES}--rpy 180deg,0deg,20deg" in run(*pose, "180,0,20").stderr
    for good in ("180deg,0,20deg", "3.1,0,0.3", "-6.2,6.2,0"):
        assert run(*pose, good).stderr == ""
    first, *_ = run("fk", "ur5e", "--q", "20,30deg,0.1,-90,0,1").stderr.splitlines()
    assert first == f"{DEGREES}--q 20deg,30deg,0.1deg,-90deg,0deg,1deg"
    assert DEGREES not in run("fk", "scara", "--q", "0,0,100,0").stderr


def test_iteration_states_that_no_closer_pose_exists():
    done = run("ik", "four_bar", "--xyz", "0.3,0.3,0.001", "--task", "position", "--numeric")
    assert "no solution (" in done.stdout
    assert "stalled" not in done.output


def test_swivel_angle_is_printed_with_the_pose():
    iiwa = chasles.load("iiwa14")
    q = [0.3, 0.5, -0.2, -1.1, 0.4, 0.7, 0.1]
    words = ("fk", "iiwa14", "--q", ",".join(map(str, q)))
    swivel = float(iiwa.swivel(q))
    line = next(one for one in run(*words).stdout.splitlines() if one.startswith("swivel [deg]"))
    assert float(line.split()[2]) == pytest.approx(math.degrees(swivel), abs=1e-4)
    assert json.loads(run(*words, "--json").stdout)["swivel"] == pytest.approx(swivel)
    assert "swivel" not in run("fk", "panda").stdout


def test_info_groups_functions_and_uses_the_units_of_fk():
    text = run("info", "iiwa14").stdout
    assert re.search(r"A1 +revolute +-170 to 170 deg\n", text)
    assert re.search(r"d1 +360 mm +base to shoulder\n", text)
    assert "inverse      ik(T, swivel), swivel(q)\n" in text
    assert " rad" not in text
    names = {one.name for one in chasles.load("iiwa14").manifest.functions}
    printed = text[text.index("\nfunctions") :]
    assert names == set(re.findall(r"(\w+)\(", printed)) - {"functions"}
    assert len(printed.splitlines()) < 10


def test_help_omits_the_type_of_flags():
    for words in (("--help",), ("ik", "--help"), ("derive", "--help")):
        assert "<bool>" not in run(*words).stdout


FLANGED = """<robot name="flanged"><link name="base"/><link name="arm"/>
<joint name="turn" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>{}</robot>"""
FIXED = """<link name="{1}"/><joint name="{1}_joint" type="fixed"><parent link="{0}"/>
<child link="{1}"/><origin xyz="0.1 0 0"/></joint>"""


@pytest.mark.parametrize(
    ("links", "tip"),
    [
        ([("arm", "flange")], "flange"),
        ([("arm", "flange"), ("flange", "mount")], "flange"),
        ([("arm", "adapter"), ("adapter", "mount")], "mount"),
    ],
)
def test_default_tip_is_the_link_that_the_help_describes(links, tip, tmp_path):
    file = tmp_path / "flanged.urdf"
    file.write_text(FLANGED.format("".join(FIXED.format(*one) for one in links)))
    assert f"frames: base to {tip}\n" in run("info", file).stdout
    for verb in ("fk", "derive"):
        text = " ".join(re.sub("[│]", " ", run(verb, "--help").stdout).split())
        assert "tool name, such as tool0, tcp or flange" in text
        assert "without such a link, the only end of the chain" in text


def test_doctor_states_which_extras_are_not_part_of_all(monkeypatch):
    monkeypatch.setattr("chasles.cli.environment._is_installed", lambda name: False)
    states = json.loads(run("doctor", "--json").stdout)
    assert states["chasles[study]"].startswith("needs ")
    for extra in ("planning", "jax", "torch"):
        state = states[f"chasles[{extra}]"]
        assert state.startswith("optional, not part of chasles[all]; needs ")


def test_table_without_a_header_is_explained(tmp_path):
    file = tmp_path / "motion.csv"
    file.write_text("0.1\n0.2\n")
    done = run("animate", "four_bar", "--play", file, "--to", tmp_path / "a.gif")
    assert done.exit_code == 1
    assert done.stderr.endswith("; add the line crank, or t,crank (with times)\n")


def test_missing_function_names_three_others_and_where_all_are_listed():
    done = run("derive", "scara", "--functions", "jacobian_mixd", "--to", "out")
    match = re.search(r"nearest functions: (.*) \(chasles info lists", done.output)
    assert match
    assert len(match[1].split(", ")) == 3
    assert match[1].startswith("jacobian_mixed, ")
