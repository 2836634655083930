"""Subcommands of the command line: output, files and wrong arguments."""

import json
import math
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

import chasles
from chasles.cli.app import app
from chasles.cli.values import value
from chasles.contract import temporary_folder
from chasles.derive import derive, read, template
from chasles.study import Workspace
from tests.support.command_line import run
from tests.support.tools import needs, path_of

ROOT = Path(__file__).parents[3]
KINDS = ("arm", "dh", "mechanism")


def test_forward_kinematics_equal_those_of_python():
    arm = chasles.load("ur5e")
    q = [0.1, -1.2, 1.3, 0.2, 0.4, -0.3]
    words = ",".join(f"{math.degrees(x)!r}deg" for x in q)
    printed = json.loads(run("fk", "ur5e", "--q", words, "--json").stdout)
    np.testing.assert_allclose(printed["T"], arm.fk(q), atol=1e-15)
    np.testing.assert_allclose(printed["q"], q, atol=1e-15)


def test_text_of_forward_kinematics_names_frames_and_units():
    done = run("fk", "scara", "--q", "90deg,0,50mm,0")
    assert done.exit_code == 0
    assert "pose of ee in 0" in done.stdout
    assert "shoulder 90 deg, elbow 0 deg, quill 50 mm, flange 0 deg" in done.stdout
    xyz = next(line for line in done.stdout.splitlines() if line.startswith("xyz [mm]"))
    assert [float(word) for word in xyz.split()[2:]] == [0, 800, 877 - 50 - 200]


def test_forward_kinematics_name_the_coordinates_outside_their_limits():
    inside = run("fk", "lynxmotion", "--q", "0,60deg,-70deg,-40deg,9")
    outside = run("fk", "lynxmotion", "--q", "0,10deg,-70deg,-40,9")
    assert "limits" not in inside.output
    assert inside.stderr == ""
    _, line = outside.stderr.splitlines()
    assert line == (
        "outside the limits: shoulder 10 deg (30 to 150 deg), "
        "wrist_pitch -2291.83 deg (-150 to 30 deg)"
    )
    (line,) = run("fk", "scara", "--q", "0,0,1,0").stderr.splitlines()
    assert line == "outside the limits: quill 1000 mm (0 to 195 mm)"
    long = run("fk", "excavator", "--q", "0,9,1,1")
    assert "boom_cylinder 9000 mm (" in long.stderr


@pytest.mark.parametrize(
    "turn",
    [("--rpy", "180deg,0,0"), ("--rotvec", "180deg,0,0"), ("--quat", "1,0,0,0", "--order", "xyzw")],
    ids=["rpy", "rotvec", "quat"],
)
def test_inverse_kinematics_print_all_solutions_of_the_pose(turn):
    done = run("ik", "ur5e", "--xyz", "300mm,0.1,500mm", *turn, "--json")
    printed = json.loads(done.stdout)
    q = np.array([one["q"] for one in printed["solutions"]])
    assert done.exit_code == 0
    assert len(q) == 8
    T = np.diag([1.0, -1, -1, 1])
    T[:3, 3] = 0.3, 0.1, 0.5
    np.testing.assert_allclose(
        chasles.load("ur5e").fk(q), np.broadcast_to(T, (8, 4, 4)), atol=1e-12
    )


def test_nearest_solution_is_the_first_of_the_sorted_ones():
    words = ("ik", "ur5e", "--xyz", "0.3,0.1,0.5", "--rpy", "180deg,0,0", "--q-seed", "1,1,1,1,1,1")
    all_of_them = json.loads(run(*words, "--json").stdout)["solutions"]
    nearest = json.loads(run(*words, "--nearest", "--json").stdout)["solutions"]
    assert len(nearest) == 1
    # The solution of --nearest may differ by full turns from the first solution without --nearest.
    turns = np.subtract(nearest[0]["q"], all_of_them[0]["q"]) / (2 * np.pi)
    np.testing.assert_allclose(turns, turns.round(), atol=1e-12)


def test_iterated_position_leaves_the_orientation_free():
    """The arm has five joints, so it cannot reach every orientation."""
    words = ("ik", "lynxmotion", "--xyz", "0.1,0.1,0.2", "--task", "position", "--numeric")
    done = run(*words, "--json")
    (solution,) = json.loads(done.stdout)["solutions"]
    p = chasles.load("lynxmotion").fk(solution["q"])[:3, 3]
    np.testing.assert_allclose(p, [0.1, 0.1, 0.2], atol=1e-9)


def test_fixed_joint_takes_a_value_with_a_unit():
    words = ("ik", "panda", "--xyz", "0.4,0,0.4", "--rpy", "180deg,0,0", "--json")
    solutions = json.loads(run(*words, "--fixed", "joint7=45deg").stdout)["solutions"]
    assert solutions
    assert {one["q"][6] for one in solutions} == {math.pi / 4}


def test_pose_out_of_reach_is_stated_with_status_1():
    done = run("ik", "ur5e", "--xyz", "3,0,0", "--rpy", "0,0,0")
    assert done.exit_code == 1
    first, nearest = done.stdout.splitlines()
    assert (
        first == "ur5e: no solution (out of reach; the best branch has the residual 2.09 (m, rad))"
    )
    match = re.fullmatch(
        r"nearest pose within the limits, (\S+) mm and (\S+) deg away: shoulder_pan .*", nearest
    )
    assert match
    assert math.hypot(float(match[1]) / 1000, math.radians(float(match[2]))) < 2.0921
    words = ("ik", "ur5e", "--xyz", "3,0,0", "--rpy", "0,0,0", "--json")
    near = json.loads(run(*words).stdout)["nearest"]
    np.testing.assert_allclose(near["T"], chasles.load("ur5e").fk(near["q"]), atol=1e-12)


def test_target_in_millimeters_without_units_gets_a_hint():
    words = ("ik", "ur5e", "--rpy", "180deg,0,0", "--xyz")
    hint = "lengths without a unit are in meters; for millimeters: --xyz 300mm,100mm,500mm"
    assert hint in run(*words, "300,100,500").stdout
    assert "meters" not in run(*words, "3,1,5").stdout
    assert "meters" not in run(*words, "300m,100,500").stdout


def test_identity_orientation_is_stated_for_poses_only():
    note = "without --rpy, --quat or --rotvec, the tool has the identity orientation\n"
    words = ("ik", "ur5e", "--xyz", "0.3,0.1,0.5")
    assert run(*words).stderr == note
    assert run(*words, "--rpy", "0,0,0").stderr == ""
    # The task "position" ignores the orientation.
    position = (*words, "--task", "position", "--numeric", "--json")
    free, turned = run(*position), run(*position, "--rpy", "1,1,1")
    assert free.stderr == turned.stderr == ""
    assert json.loads(free.stdout)["solutions"] == json.loads(turned.stdout)["solutions"]


def test_nearest_solution_starts_from_the_stated_reference_configuration():
    words = ("ik", "ur5e", "--xyz", "0.3,0.1,0.5", "--rpy", "180deg,0,0", "--nearest")
    done = run(*words)
    assert done.stderr.startswith(
        "without --q-seed, nearest to the reference configuration: shoulder_pan "
    )
    reference = ",".join(map(repr, chasles.load("ur5e").q_reference.tolist()))
    assert done.stdout == run(*words, "--q-seed", reference).stdout


def test_inverse_names_the_coordinates_outside_their_limits():
    done = run("ik", "irb6640", "--xyz", "1,0,0.1", "--rpy", "180deg,0,0")
    assert done.stdout.splitlines()[-1].endswith(
        "  outside the limits: axis1 -180 deg (-170 to 170 deg), axis3 177.702 deg (-180 to 70 deg)"
    )


def test_main_chain_is_printed_with_the_pose():
    arm = chasles.load("excavator")
    assert "main chain: swing 0 deg, boom 9.42 deg, stick" in run("fk", "excavator").stdout
    printed = json.loads(run("fk", "excavator", "--json").stdout)
    np.testing.assert_allclose(printed["theta"], arm.chain(arm.q_reference), atol=1e-15)
    assert "theta" not in json.loads(run("fk", "ur5e", "--json").stdout)


def test_actuators_follow_from_some_joints_of_the_main_chain():
    arm = chasles.load("excavator")
    theta = [0.1, 0.3, -1.5, -0.4]
    words = [f"{one.name}={x}" for one, x in zip(arm.chain_joints, theta, strict=True)]
    expected = dict(zip(arm.coordinate_names, arm.actuators(theta), strict=True))
    done = run("actuators", "excavator", "--theta", ",".join(words), "--json")
    assert json.loads(done.stdout)["actuators"] == pytest.approx(expected, abs=1e-12)
    boom = run("actuators", "excavator", "--theta", "boom=0.3", "--json")
    assert json.loads(boom.stdout)["actuators"] == pytest.approx(
        {"boom_cylinder": expected["boom_cylinder"]}, abs=1e-12
    )
    assert "boom_cylinder" in run("actuators", "excavator", "--theta", "boom=0.3").stdout


def test_open_loop_of_a_main_chain_is_stated():
    done = run("actuators", "four_bar", "--theta", "crank=3,coupler=1")
    assert done.stderr.startswith("the loops do not close at these joints")
    assert run("actuators", "board_installer", "--theta", "elbow=0.1").exit_code == 1


FIVE_JOINTS = ("lynxmotion", "--q", "30deg,60deg,-70deg,-40deg,20deg")


def printed_pose(*words):
    lines = run("fk", *words).stdout.splitlines()
    xyz, rpy = (
        next(line for line in lines if line.startswith(head)).split()[2:] for head in ("xyz", "rpy")
    )
    return (
        *("--xyz", ",".join(f"{word}mm" for word in xyz)),
        *("--rpy", ",".join(f"{word}deg" for word in rpy)),
    )


@pytest.mark.parametrize("way", [(), ("--numeric",), ("--nearest", "--q-seed", FIVE_JOINTS[2])])
def test_inverse_takes_the_printed_pose_of_an_arm_with_five_joints(way):
    words = ("ik", FIVE_JOINTS[0], *printed_pose(*FIVE_JOINTS), *way)
    done = run(*words)
    assert done.exit_code == 0, done.output
    assert re.search(
        r"\d solutions? for a rounded pose, residual \S+e-0\d \(m, rad\), \d", done.stdout
    )
    printed = json.loads(run(*words, "--json").stdout)
    q = np.array([one["q"] for one in printed["solutions"]])
    assert 1e-9 < printed["residual"] < 3e-6
    assert way or np.abs(q - np.radians([30, 60, -70, -40, 20])).max(1).min() < 1e-5
    assert np.abs(chasles.load(FIVE_JOINTS[0]).fk(q)[:, :3] - target(words)[:3]).max() < 3e-6


def target(words):
    T = np.eye(4)
    T[:] = json.loads(run(*words, "--json").stdout)["T"]
    return T


@pytest.mark.parametrize("way", [(), ("--numeric",)])
def test_inverse_states_the_residual_of_a_coarsely_rounded_pose(way):
    pose = [re.sub(r"(\.\d)\d+", r"\1", word) for word in printed_pose(*FIVE_JOINTS)]
    done = run("ik", FIVE_JOINTS[0], *pose, *way)
    assert done.exit_code == 1
    assert re.search(
        r"no solution \(.*; the best branch has .* residual 0\.0002\d+ \(m, rad\)\)\nnearest .*\n",
        done.stdout,
    )


def test_redundant_arm_asks_for_the_option_that_fixes_a_joint():
    done = run("ik", "panda", "--xyz", "0.4,0,0.4", "--rpy", "180deg,0,0")
    assert done.exit_code == 1
    assert "such as --fixed joint7=10deg" in done.stderr
    assert "fixed={" not in done.stderr
    assert "ik_nearest(" not in done.stderr


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("fk", "ur5e", "--q", "1,2"), "--q: expected 6 numbers (shoulder_pan, shoulder_lift"),
        (("fk", "ur5e", "--q", "1mm,0,0,0,0,0"), "--q, shoulder_pan: expected a number in rad"),
        (("fk", "ur5e", "--q", "one,0,0,0,0,0"), "got 'one'"),
        (("fk", "ur5ee"), "no robot named 'ur5ee'; did you mean ur5e"),
        (("ik", "ur5e", "--xyz", "0,0,0", "--quat", "1,0,0,0"), "--quat also requires --order"),
        (("actuators", "four_bar", "--theta", "crack=1"), "(crank, coupler), got 'crack=1'"),
        (
            ("actuators", "ur5e", "--theta", "a=1"),
            "ur5e: the main-chain joints do not determine any actuator",
        ),
        (("fk", "ur5e", "1,2,3,4,5,6"), "fk: pass the coordinates with --q, as in --q 1,2,3,4,5,6"),
        (
            ("ik", "scara", "--xyz", "0,0,0", "--task", "position"),
            "with a closed form: --task pose. Add --numeric to find one solution by iteration",
        ),
        (("ik", "panda", "--xyz", "0,0,0", "--fixed", "joint7"), "expected JOINT=VALUE"),
        (
            ("ik", "lynxmotion", "--xyz", "0,0,0", "--task", "position", "--fixed", "wrist_roll=0"),
            "--fixed also requires --nearest or --numeric for --task position",
        ),
        (("draw", "ur5e", "--views", "behind"), "behind"),
        (("view", "ur5e", "--html", "a.html", "--port", "1"), "--play and --port require"),
        (("derive", "missing.toml", "--to", "out"), "missing.toml: no such file"),
        (("pdf", "missing.toml"), "missing.toml"),
    ],
)
def test_error_is_one_sentence_with_status_1(words, message):
    if words[0] == "pdf":
        path_of("pdflatex")
    done = run(*words)
    assert done.exit_code == 1
    assert done.stdout == ""
    assert message in done.stderr
    assert "Traceback" not in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


def test_defect_prints_a_traceback_and_where_to_report_it(monkeypatch):
    monkeypatch.setattr("chasles.cli.solving.load", lambda *_, **__: 1 / 0)
    done = run("fk", "ur5e")
    assert done.exit_code == 1
    assert "ZeroDivisionError" in done.stderr
    assert "Please report it" in done.stderr


@pytest.mark.parametrize("words", [("dervie",), ("fk", "ur5e", "--qq", "1"), ("new", "arms")])
def test_wrong_argument_has_status_2_and_a_hint(words):
    done = run(*words)
    assert done.exit_code == 2
    assert "derive" in done.stderr or "--q" in done.stderr or "'arm'" in done.stderr


@pytest.mark.parametrize(
    "verb", sorted(command.name or command.callback.__name__ for command in app.registered_commands)
)
def test_each_verb_has_a_help_with_an_example(verb):
    done = run(verb, "--help")
    assert done.exit_code == 0
    assert f"Example: chasles {verb}" in done.stdout


@pytest.mark.parametrize("words", [(), ("derive",), ("ik",), ("explain",)], ids=" ".join)
def test_command_without_arguments_prints_its_help(words):
    done = run(*words)
    assert done.exit_code == 2
    assert "Usage: chasles" in done.output


@pytest.mark.parametrize("kind", KINDS)
def test_template_derives_without_notes_and_has_an_inverse(kind, tmp_path):
    file = tmp_path / f"{kind}.toml"
    assert run("new", kind, "--to", file).exit_code == 0
    robot = read(file)
    assert robot.notes == ()
    names = [function.name for function in derive(robot).functions]
    assert {"ik", "ik_position", "actuators"} & set(names)
    assert run("new", kind, "--to", file).exit_code == 1
    assert file.read_text() == template(kind)


def test_comments_of_revolute_joints_in_the_table_name_no_length():
    head, *joints = template("dh").split("[[joints]]")
    assert 'type = "prismatic"' in head
    assert len(joints) == 6
    for joint in joints:
        assert "prismatic" not in joint
        assert "mm" not in joint


def test_unknown_template_is_refused():
    with pytest.raises(chasles.InputValueError, match="expected one of arm, dh, mechanism"):
        template("leg")


def test_cache_is_emptied_without_touching_other_files(tmp_path, monkeypatch):
    monkeypatch.setenv("CHASLES_CACHE", str(tmp_path))
    library = tmp_path / f"ur5e-{'0' * 32}.so"
    other = tmp_path / "thesis.tex"
    derived = tmp_path / "derived" / "arm" / "manifest.json"
    derived.parent.mkdir(parents=True)
    for file in (library, other, derived):
        file.write_text("12345")
    assert json.loads(run("cache", "--json").stdout) == {
        "folder": str(tmp_path),
        "files": 2,
        "bytes": 10,
        "removed": False,
    }
    with temporary_folder(tmp_path, "arm") as in_use:
        (tmp_path / f".chasles-arm-{'0' * 16}").mkdir()
        assert "removed from" in run("cache", "--clean").stdout
        assert sorted(tmp_path.iterdir()) == sorted([other, in_use])


def test_cleaning_keeps_a_derivation_in_progress(tmp_path, monkeypatch):
    monkeypatch.setenv("CHASLES_CACHE", str(tmp_path))
    derived = tmp_path / "derived"
    (derived / f".chasles-arm-{'0' * 16}").mkdir(parents=True)
    (derived / "arm-1-2").mkdir()
    with temporary_folder(derived, "arm") as in_use:
        (derived / f".chasles-arm-{'0' * 16}").mkdir()
        run("cache", "--clean")
        assert list(derived.iterdir()) == [in_use]
    run("cache", "--clean")
    assert not derived.exists()


def test_new_replaces_no_file(tmp_path):
    file, link = tmp_path / "arm.toml", tmp_path / "link.toml"
    file.write_text("former")
    link.symlink_to(tmp_path / "missing.toml")
    for path in (file, link):
        done = run("new", "arm", "--to", path)
        assert done.exit_code == 1
        assert done.stderr == f"chasles: {path}: the file cannot be written (it exists already)\n"
    assert file.read_text() == "former"
    assert sorted(tmp_path.iterdir()) == [file, link]


def test_doctor_names_compiler_cache_and_missing_packages(monkeypatch):
    monkeypatch.setattr("chasles.cli.environment._is_installed", lambda name: "viser" not in name)
    monkeypatch.setenv("CC", "no_such_compiler")
    states = json.loads(run("doctor", "--json").stdout)
    assert "no C compiler" in states["compiler"]
    assert states["chasles[view]"] == "needs viser>=1.1: pip install 'chasles[view]'"
    assert states["chasles[derive]"] == "installed"


def test_every_extra_of_doctor_is_one_of_the_package():
    from chasles.cli.environment import _EXTRAS, _packages

    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert set(_EXTRAS) <= set(project["optional-dependencies"])
    assert all(_packages(extra) for extra in _EXTRAS)


@pytest.mark.parametrize(
    ("text", "unit", "expected"),
    [
        ("90deg", "rad", math.pi / 2),
        ("-1.5", "rad", -1.5),
        ("250 mm", "m", 0.25),
        ("2.5e1cm", "m", 0.25),
        ("1", "", 1.0),
    ],
)
def test_number_with_a_unit_is_converted(text, unit, expected):
    assert value(text, unit, "x") == pytest.approx(expected, rel=1e-15)


def test_film_shows_a_table_or_moves_every_joint(tmp_path, monkeypatch):
    pytest.importorskip("matplotlib")
    image = pytest.importorskip("PIL.Image")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "turn.csv").write_text("crank\n1.5\n1.6\n1.7\n")
    done = run("animate", "four_bar", "--play", "turn.csv", "--to", "turn.gif", "--fps", 20)
    assert done.exit_code == 0, done.output
    assert done.stdout == "written: turn.gif\n"
    with image.open(tmp_path / "turn.gif") as film:
        assert film.n_frames == 3
        width = film.width
    done = run("animate", "four_bar", "--fps", 2.5, "--views", "plane,axonometric")
    assert done.exit_code == 0, done.output
    with image.open(tmp_path / "four_bar.gif") as film:
        assert film.n_frames == 10
        assert film.width == width
    refused = run("draw", "four_bar", "--to", "x.gif").stderr
    assert "expected a picture, got 'x.gif'; call animate" in refused


@pytest.mark.parametrize("robot", ["five_bar", "scara"])
def test_workspace_is_drawn_or_saved(robot, tmp_path, monkeypatch):
    pytest.importorskip("matplotlib")
    monkeypatch.chdir(tmp_path)
    words = ("workspace", robot, "--samples", 1000, "--resolution", 10)
    assert "1,000 configurations" in run(*words).stdout
    assert (tmp_path / f"{robot}_workspace.svg").read_text().startswith("<?xml")
    assert run(*words, "--to", "region.npz").exit_code == 0
    saved = Workspace.load("region.npz")
    assert saved.hits.sum() == saved.samples - saved.n_open == 1000 - saved.n_open


@pytest.fixture
def little_memory():
    """Limit the address space to one gibibyte above its present size."""
    resource = pytest.importorskip("resource")
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    limits = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + 2**30, limits[1]))
    yield
    resource.setrlimit(resource.RLIMIT_AS, limits)


@pytest.mark.usefixtures("little_memory")
def test_missing_memory_is_one_sentence():
    words = ("workspace", "scara", "--samples", 10, "--resolution", 2000, "--no-progress")
    done = run(*words)
    assert (done.exit_code, done.stdout) == (1, "")
    assert re.fullmatch(r"chasles: Unable to allocate .*\n", done.stderr)


@needs("pdflatex")
def test_pdf_prints_shipped_and_derived_articles(tmp_path):
    linkage = tmp_path / "linkage.toml"
    linkage.write_text(template("dh"))
    for robot, file in (("four_bar", tmp_path / "a.pdf"), (linkage, tmp_path / "b.pdf")):
        done = run("pdf", robot, "--to", file)
        assert done.exit_code == 0, done.output
        assert file.read_bytes().startswith(b"%PDF")


BEVEL = """
name = "bevel"
convention = "urdf"

[[joints]]
name = "pitch"
axis = [0, 1, 0]
limits = [-1.5, 1.5]

[[joints]]
name = "roll"
axis = [1, 0, 0]

[couplings]
pitch = { m1 = "1/2", m2 = "1/2" }
roll = { m1 = "1/2", m2 = "-1/2" }
"""


def test_info_shows_motors_and_the_limits_of_the_joints_that_they_move(tmp_path):
    file = tmp_path / "bevel.toml"
    file.write_text(BEVEL)
    text = run("info", file).stdout
    assert text.startswith("bevel\n")
    assert re.search(r"m1 +revolute +unlimited\n", text)
    assert re.search(r"pitch +revolute +-85.9437 to 85.9437 deg: 0.5 m1, 0.5 m2\n", text)
    assert re.search(r"roll +revolute +unlimited: 0.5 m1, -0.5 m2\n", text)
    assert "parameters:" not in text
