"""Test the command line of `derive`: written files, up-to-date checks and errors."""

import json
import math
from importlib.metadata import PackageNotFoundError
from pathlib import Path

import pytest

import chasles
from chasles.derive import build, read, write
from chasles.derive.build import freshness, jobs, time_limit
from chasles.derive.build.time_limit import OutOfTime, at_most
from tests.support.command_line import run
from tests.support.derivations import ALL, ROBOTS

ARM = """\
name = "arm"
convention = "dh"
[[joints]]
a = "0.3"
[[joints]]
type = "prismatic"
alpha = "pi/2"
"""

CURRENT = "nothing to derive: all is up to date\n"


@pytest.fixture
def arm(tmp_path):
    path = tmp_path / "arm.toml"
    path.write_text(ARM)
    return path


QUICKLY = ("--functions", "fk", "--languages", "c")
"""Command-line options for a short run: only `fk` is derived, and only C code is written."""


def files(folder):
    return {p.relative_to(folder) for p in folder.rglob("*") if p.is_file()}


def test_cli_derives_again_only_after_a_change(arm, tmp_path):
    to = tmp_path / "out"
    first = run("derive", arm, "--to", to)
    assert first.exit_code == 0, first.output
    assert "arm" in first.output
    assert "17 functions" in first.output
    assert {"arm.c", "arm.h", "arm.tex", "manifest.json"} <= {p.name for p in files(to)}
    assert run("derive", arm, "--to", to).output == CURRENT
    words = (arm, "--to", to, *QUICKLY)
    assert "1 function" in run("derive", *words).output
    arm.write_text(ARM.replace("0.3", "0.31"))
    assert "1 function" in run("derive", *words).output
    (to / "arm" / "arm.c").write_text("tampered")
    assert "1 function" in run("derive", *words).output
    assert "tampered" not in (to / "arm" / "arm.c").read_text()


def test_functions_option_limits_output_and_rejects_unknown_names(arm, tmp_path):
    to = tmp_path / "out"
    assert (
        run(
            "derive", arm, "--to", to, "--functions", "fk, twist_mixed", "--detail", "none"
        ).exit_code
        == 0
    )
    assert "arm_twist_mixed(" in (to / "arm" / "arm.h").read_text()
    done = run("derive", arm, "--to", to, "--functions", "fk, jacobian_mixed", "--detail", "none")
    assert done.exit_code == 0, done.output
    header = (to / "arm" / "arm.h").read_text()
    assert "arm_fk(" in header
    assert "arm_twist_mixed(" not in header
    for check in ((), ("--up-to-date",)):
        unknown = run("derive", arm, "--to", to, "--functions", "fkk", *check)
        assert unknown.exit_code == 1
        assert "arm has no function fkk" in unknown.output


def test_invalid_file_prevents_writing_of_all_robots(arm, tmp_path):
    wrong = tmp_path / "wrong.toml"
    wrong.write_text(ARM.replace('"0.3"', '"0.3.1"'))
    to = tmp_path / "out"
    done = run("derive", arm, wrong, "--to", to)
    assert done.exit_code == 1
    assert "wrong.toml:4: joints[1].a: expected" in done.output
    assert "nothing was written" in done.output
    assert not to.exists()


def test_two_robots_with_the_same_name_are_rejected(arm, tmp_path):
    twin = tmp_path / "twin.toml"
    twin.write_text(ARM)
    done = run("derive", arm, twin, "--to", tmp_path / "out")
    assert done.exit_code == 1
    assert "robot 'arm' is also described in" in done.output


def test_unknown_robot_error_lists_available_robots():
    done = run("derive", "nope")
    assert done.exit_code == 1
    assert f"expected a robot file, or one of {', '.join(ALL)}" in done.output


@pytest.mark.parametrize("name", ["panda.urdf", "robots/panda"])
def test_missing_file_is_reported(name):
    done = run("explain", name)
    assert done.exit_code == 1
    assert done.output.strip() == f"{name}: no such file"


def test_internal_error_stops_only_the_affected_robot(arm, tmp_path, monkeypatch):
    derive = jobs.derive

    def fails(robot, *choices, **options):
        if robot.name == "arm":
            return {}["[/key]"]
        return derive(robot, *choices, **options)

    monkeypatch.setattr(jobs, "derive", fails)
    other = arm.with_name("other.toml")
    other.write_text(ARM.replace('"arm"', '"other"'))
    done = run("derive", arm, other, "--to", tmp_path / "out", *QUICKLY)
    assert done.exit_code == 1
    assert f"{arm}: chasles fails on this file; please report" in done.output
    assert "KeyError: '[/key]'" in done.output
    assert (tmp_path / "out" / "other" / "other.c").is_file()
    assert not (tmp_path / "out" / "arm").exists()


def test_repeated_robot_is_derived_only_once(arm, tmp_path):
    done = run("derive", arm, arm, "--to", tmp_path / "out", *QUICKLY)
    assert done.exit_code == 0, done.output
    assert "1 robot written" in done.output


def test_check_reports_changed_missing_and_stale_files(arm, tmp_path):
    to = tmp_path / "out"
    words = (arm, "--to", to, "--functions", "fk", "--detail", "brief")
    assert run("derive", *words).exit_code == 0
    assert run("derive", *words, "--up-to-date").exit_code == 0
    source = to / "arm" / "arm.c"
    text = source.read_text()
    source.write_text(text + "\n")
    assert "out of date: arm.c" in run("derive", *words, "--up-to-date").output
    source.unlink()
    done = run("derive", *words, "--up-to-date")
    assert done.exit_code == 1
    assert "out of date: arm.c" in done.output
    source.write_text(text)
    (to / "arm" / "latex" / "old.tex").write_text("old")
    assert "out of date: latex/old.tex" in run("derive", *words, "--up-to-date").output


def test_check_names_folders_without_a_description(arm, tmp_path, monkeypatch):
    to = tmp_path / "out"
    monkeypatch.setattr(build, "GENERATED", to)
    monkeypatch.setattr(build, "ROBOTS", arm.parent)
    for name in ("arm", "gone"):
        (to / name).mkdir(parents=True)
        (to / name / "manifest.json").write_text("{}")
    done = run("derive", arm, "--to", to, "--up-to-date", "--functions", "fk")
    assert done.exit_code == 1
    assert "no description for gone\n" in done.output


def test_missing_package_of_the_compiler_is_named_with_its_command(arm, tmp_path, monkeypatch):
    def absent(name):
        raise PackageNotFoundError(name)

    monkeypatch.setattr(freshness, "version", absent)
    freshness._compiler.cache_clear()
    done = run("derive", arm, "--to", tmp_path / "out")
    assert done.exit_code == 1
    assert done.stderr == "chasles: casadi is not installed: pip install 'chasles[derive]'\n"


def test_freshness_check_does_not_import_sympy_or_casadi():
    text = Path(freshness.__file__).read_text() + Path(build.__file__).read_text()
    assert "import sympy" not in text
    assert "import casadi" not in text


def test_shipped_file_names_equal_robot_names():
    from chasles.derive import read

    assert [read(ROBOTS / f"{name}.toml").name for name in ALL] == ALL


def test_unshipped_robot_requires_an_output_folder(arm):
    done = run("derive", arm)
    assert done.exit_code == 1
    assert "--to FOLDER is required, except for unmodified shipped robots" in done.output


def test_shelf_robots_require_and_use_the_output_folder(tmp_path):
    to = tmp_path / "out"
    done = run("derive", "ur10e", "--functions", "fk", "--detail", "none", "--to", to)
    assert done.exit_code == 0, done.output
    assert [path.name for path in to.iterdir()] == ["ur10e"]


def test_unwritable_output_folder_is_rejected(arm):
    done = run("derive", arm, "--to", arm)
    assert done.exit_code == 1
    assert f"{arm}: the folder cannot be created (a file has this path)" in done.output


@pytest.mark.parametrize(
    "files", ['["../precious", "old"]', '{"../precious": 1, "old": 2}', "[3]", '["\\u0000"]', "7"]
)
def test_files_outside_the_folder_are_never_removed(arm, tmp_path, files):
    folder = tmp_path / "out" / "arm"
    folder.mkdir(parents=True)
    (tmp_path / "out" / "precious").touch()
    (folder / "old").touch()
    (folder / "manifest.json").write_text(f'{{"files": {files}}}', encoding="utf-8")
    write(read(arm), folder, functions=["fk"], languages=["c"])
    assert (tmp_path / "out" / "precious").exists()
    assert (folder / "old").exists() != ("old" in files)


def test_base_option_names_the_links_of_the_file(arm, tmp_path):
    done = run("derive", arm, "--to", tmp_path / "out", "--base", "world")
    assert done.exit_code == 1
    assert "base: expected a link of the file (link1, link2, 0, ee), found 'world'" in done.output


def test_misspelled_robot_name_gets_a_suggestion():
    assert "did you mean puma560?" in run("derive", "puma").output
    assert "did you mean ur10e?" in run("derive", "ur10ee").output


def test_cli_snaps_and_reports_rounded_numbers_unless_exact(arm, tmp_path):
    arm.write_text(ARM.replace('"pi/2"', '"1.5708"'))
    to = tmp_path / "out"
    words = (arm, "--to", to, *QUICKLY)
    done = run("derive", *words)
    first, note = (line.strip() for line in done.output.splitlines()[:2])
    assert first.endswith("1 number cleaned, at most 0 m and 3.7e-06 rad")
    assert note == "1.5708 interpreted as pi/2: alpha of joint2"
    manifest = json.loads((to / "arm" / "manifest.json").read_text())
    assert manifest["notes"] == ["1 number cleaned, at most 0 m and 3.7e-06 rad", note]
    found = manifest["cleaning"]
    assert found["orientation"] == pytest.approx(1.5708 - math.pi / 2, rel=1e-9)
    assert found["numbers"] == [
        {"at": "joint2", "field": "alpha", "found": "1.5708", "taken": "pi/2"}
    ]
    loaded = chasles.load(to / "arm")
    assert loaded.cleaning.orientation == found["orientation"]
    assert loaded.cleaning.numbers[0].taken == "pi/2"
    assert loaded.notes == tuple(manifest["notes"])
    cleaned = (to / "arm" / "arm.c").read_text()
    # The generated folder stores which functions were selected.
    assert run("derive", *words).output == CURRENT
    exact = run("derive", *words, "--exact")
    assert "cleaned" not in exact.output
    assert "cleaning" not in (to / "arm" / "manifest.json").read_text()
    assert (to / "arm" / "arm.c").read_text() != cleaned
    assert run("derive", *words, "--exact").output == CURRENT
    assert chasles.load(to / "arm").cleaning.numbers == ()
    assert "1 function" in run("derive", *words).output


def test_model_option_prints_report_and_rejects_platforms():
    done = run("explain", "four_bar", "--conventions")
    assert done.exit_code == 0, done.output
    assert "as described: 26 parameters with base and tool, rank 14: complete" in done.output
    assert "det(D^T D)" in done.output
    platform = run("explain", "delta", "--conventions")
    assert platform.exit_code == 1
    assert "legs carry its tool" in platform.output


@pytest.mark.parametrize(
    "words", [("derive", "--to", "out"), ("explain",)], ids=["derive", "explain"]
)
def test_time_limit_error_states_where_derivation_stopped(arm, tmp_path, monkeypatch, words):
    monkeypatch.chdir(tmp_path)
    done = run(*words, arm, "--time-limit", "0.001")
    assert done.exit_code == 1
    assert "took longer than 0.001 s and was stopped in " in done.output
    assert "raise --time-limit" in done.output
    assert not list(tmp_path.glob("out/*/*"))


def endless(caught):
    """Loop forever and catch all errors, as some SymPy code does."""
    while True:
        try:
            sum(range(1000))
        except Exception as error:
            caught.append(error)


def test_time_limit_is_not_caught_by_library_code():
    caught = []
    with pytest.raises(OutOfTime, match="was stopped in a library"), at_most(0.05):
        endless(caught)
    assert caught == []
    with at_most(0.0), at_most(60):
        pass


def test_repeated_time_limit_signal_does_not_disturb_unwinding(monkeypatch):
    monkeypatch.setattr(time_limit, "REPEATED", 5e-4)
    for _ in range(100):
        with pytest.raises(OutOfTime), at_most(1e-3):
            endless([])


def test_invalid_toml_names_are_rejected_and_urdf_names_adapted(arm, tmp_path):
    for name in ("two__arms", "arm_"):
        arm.write_text(ARM.replace('"arm"', f'"{name}"'))
        done = run("derive", arm, "--to", tmp_path / "out")
        assert "arm.toml:1: name: expected a robot's name" in done.output
    urdf = """<robot name="{}"><link name="a"/><link name="b"/><joint name="j" type="revolute">
    <parent link="a"/><child link="b"/><limit lower="-1" upper="1"/></joint></robot>"""
    path = tmp_path / "arm.urdf"
    for name, safe in (("my--arm (2)", "my_arm_2"), ("class", "xclass"), ("_", "x")):
        path.write_text(urdf.format(name))
        assert read(path).name == safe


def test_fixed_joints_are_selected_on_the_command_line(tmp_path):
    wanted = ("panda", "--functions", "ik,fk", "--detail", "none", "--fixed", "joint4")
    own = run("derive", *wanted)
    assert own.exit_code == 1
    assert "--to FOLDER is required, except for unmodified shipped robots" in own.output
    to = tmp_path / "out"
    done = run("derive", *wanted, "--to", to)
    assert done.exit_code == 0, done.output
    manifest = json.loads((to / "panda" / "manifest.json").read_text())
    inverse = next(f for f in manifest["functions"] if f["role"] == "inverse")
    assert [item["name"] for item in inverse["inputs"]] == ["T", "q4"]
    assert "nothing to derive" in run("derive", *wanted, "--to", to).output
    wrong = run("derive", "panda", "--fixed", "elbow", "--to", to)
    assert wrong.exit_code == 1
    assert "panda: cannot fix unknown joint elbow; expected one of joint1, joint2" in wrong.output
    explained = run("explain", "photo_robot", "--fixed", "theta2, r4")
    assert "Structure: spherical wrist, with theta2 and r4 fixed." in explained.output


def test_source_files_include_extended_and_nominal_files(tmp_path):
    design = (ROBOTS / "four_bar.toml").read_text()
    built, heir = tmp_path / "built.toml", tmp_path / "heir.toml"
    (tmp_path / "design.toml").write_text(design)
    built.write_text(design.replace("units =", 'nominal = "design.toml"\nunits =', 1))
    heir.write_text('extends = "built.toml"\nname = "heir"\n')
    expected = [heir, built, tmp_path / "design.toml"]
    assert freshness.source_files(freshness.Job(heir, tmp_path)) == expected
    built.write_text(design.replace("units =", 'nominal = "four_bar"\nunits =', 1))
    expected = [built, ROBOTS / "four_bar.toml"]
    assert freshness.source_files(freshness.Job(built, tmp_path)) == expected


def test_languages_and_detail_are_selected_on_the_command_line(tmp_path):
    to = tmp_path / "out"
    words = ("scara", "--functions", "fk", "--to", to)
    assert run("derive", *words, "--languages", "c, casadi_c", "--no-progress").exit_code == 0
    assert (to / "scara" / "scara_casadi.c").is_file()
    assert not (to / "scara" / "latex").exists()
    assert run("derive", *words, "--languages", "c,latex", "--detail", "brief").exit_code == 0
    assert (to / "scara" / "latex").is_dir()
    wrong = run("derive", *words, "--languages", "c,fortran")
    assert wrong.exit_code == 1
    assert "unknown language 'fortran'; expected one of c, casadi, python, latex" in wrong.output
    assert "--to FOLDER is required" in run("derive", "scara", "--languages", "c").output
