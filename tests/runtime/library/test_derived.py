"""`chasles.load` derives a named robot or a robot file on first use.

Interruptions leave no incomplete files.
"""

import json
import os
import pickle
import re
import shutil
import signal
import subprocess
import sys
import threading
import venv
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import chasles
from chasles import robot as robot_module
from chasles.cli.app import run as main
from chasles.derive import read_text
from chasles.library import derived as described
from tests.support.compiling import COMPILER, TCC, compiled, derived_here
from tests.support.waiting import SECONDS, until

ROOT = Path(__file__).parents[3]
ARM = """\
name = "elbow_arm"
convention = "dh"
parameters = { a1 = 0.3 }
joints = [{ a = "a1" }, { a = 0.2 }]
"""
URDF = """\
<robot name="hinge">
  <link name="base"/><link name="lid"/>
  <joint name="hinge" type="revolute">
    <parent link="base"/><child link="lid"/>
    <origin xyz="0 0 0.1"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/>
  </joint>
</robot>
"""
FEW = ("--functions", "fk")
"""Options with which the robot compiler derives only `fk`. The derivation of `fk` takes a fraction
of the time that the derivation of all functions takes."""
FIND = f"""\
import sys, chasles
from chasles.library import derived as described
run = described._run_compiler
described._run_compiler = lambda file, folder, options: run(file, folder, (*options, *{FEW}))
print(chasles.find_folder(sys.argv[1]))
"""


@pytest.fixture(autouse=True)
def fast(cache, monkeypatch):
    """Set an empty cache and compiler flags for fast compilation."""
    monkeypatch.setenv("CHASLES_CFLAGS", "-O0")
    if compiler := TCC or COMPILER:
        monkeypatch.setenv("CC", compiler)


@pytest.fixture
def here(monkeypatch):
    """Run the compiler of chasles in the test process."""
    monkeypatch.setattr(described, "_finished", derived_here)


@pytest.fixture
def few(monkeypatch, here):
    """Run the compiler of chasles in the test process, and derive only forward kinematics."""
    derive_few(monkeypatch, FEW)


@pytest.fixture
def described_only(monkeypatch):
    """Load robots without compiled functions, because compilation takes a second."""

    def named_functions(manifest, *_):
        return dict.fromkeys(function.name for function in manifest.functions)

    monkeypatch.setattr(robot_module, "load_functions", named_functions)


def derive_few(monkeypatch, functions):
    """Make the runtime call the compiler with additional options."""
    run = described._run_compiler

    def run_few(description, folder, options):
        run(description, folder, (*options, *functions))

    monkeypatch.setattr(described, "_run_compiler", run_few)


@pytest.mark.parametrize("name", ["lanes", "batch", "glue"])
def test_robot_named_like_chasles_source_file_compiles(tmp_path, name):
    robot = compiled(read_text(ARM.replace("elbow_arm", name)), tmp_path / name, ["fk"], ["c"])
    np.testing.assert_allclose(robot.fk([0, 0])[0, 3], 0.5)


def test_chasles_include_guards_never_clash_with_robot_guards():
    folders = ("derive/emit/c/support/**", "contract", "runtime/library")
    headers = [path for folder in folders for path in ROOT.glob(f"{folder}/*.h")]
    guards = {g for h in headers for g in re.findall(r"#ifndef (\w+_H)\b", h.read_text())}
    assert len(guards) > 20
    assert not [g for g in guards if g.startswith(("CHASLES_ROBOT_", "CHASLES_BATCH_OF_"))]


@pytest.mark.usefixtures("few")
def test_robot_name_with_chasles_prefix_is_rejected(tmp_path):
    path = tmp_path / "arm.toml"
    path.write_text(ARM.replace("elbow_arm", "chasles_rigid"))
    with pytest.raises(chasles.DerivationError, match="does not start with chasles_"):
        chasles.load(path)


@pytest.fixture
def arm(tmp_path):
    path = tmp_path / "elbow_arm.toml"
    path.write_text(ARM)
    return path


def derived(cache):
    """List all folders in the cache of derived robots."""
    return sorted(path.name for path in (cache / "derived").iterdir())


def finding(robot, python=sys.executable):
    """Start a process that searches for the folder of a robot."""
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    return subprocess.Popen([python, "-c", FIND, str(robot)], start_new_session=True, **pipes)


@pytest.mark.usefixtures("here")
def test_shelf_robot_is_derived_once_on_first_use(cache, capfd, monkeypatch):
    derive_few(monkeypatch, ("--functions", "fk,fk_jacobian_mixed,ik"))
    assert "ur10e" in chasles.shelf_robots()
    robot = chasles.load("ur10e")
    assert capfd.readouterr().err == "chasles: deriving ur10e once, a few seconds ...\n"
    q = np.array([0.1, -0.5, -1.2, 0.9, 0.4, 0.3])
    found = robot.ik(robot.fk(q))
    assert np.abs(found.q[found.valid] - q).max(axis=-1).min() < 1e-9
    pickled = pickle.dumps(robot.fk)
    assert str(cache).encode() not in pickled
    np.testing.assert_array_equal(pickle.loads(pickled)(q), robot.fk(q))
    assert chasles.load("ur10e") == robot
    assert capfd.readouterr().err == ""
    assert len(derived(cache)) == 1


@pytest.mark.usefixtures("here", "described_only")
def test_derivation_message_mentions_parametric_functions(arm, capfd, monkeypatch):
    derive_few(monkeypatch, ("--functions", "fk,fk_p"))
    robot = chasles.load(arm, parametric=True)
    said = "chasles: deriving elbow_arm with parametric functions once, a few seconds ...\n"
    assert capfd.readouterr().err == said
    assert "fk_p" in {function.name for function in robot.manifest.functions}
    assert chasles.load(arm, parametric=True).folder == robot.folder


def test_shelf_names_are_disjoint_from_generated_robots():
    assert len(chasles.shelf_robots()) >= 35
    assert not set(chasles.shelf_robots()) & set(chasles.robots())


@pytest.mark.usefixtures("few", "described_only")
def test_robot_file_and_urdf_load_from_path_strings(arm, tmp_path, monkeypatch):
    (tmp_path / "door.urdf").write_text(URDF)
    monkeypatch.chdir(tmp_path)
    assert chasles.load("elbow_arm.toml").name == chasles.load(arm).name == "elbow_arm"
    assert chasles.load("door.urdf").tip_frame == "lid"


@pytest.mark.usefixtures("few", "described_only")
def test_warnings_of_the_compiler_are_warnings_of_load(arm):
    arm.write_text(ARM.replace('{ a = "a1" }', '{ a = "a1", alpha = "1.57" }').replace("0.2", "2"))
    with pytest.warns(UserWarning, match=r"^/.*elbow_arm\.toml: exact values .* --exact"):
        robot = chasles.load(arm)
    assert robot.cleaning.position > 5e-4
    assert chasles.load(arm).cleaning == robot.cleaning


@pytest.mark.usefixtures("few")
def test_a_changed_description_is_derived_again(arm, tmp_path, cache):
    heir = tmp_path / "long_arm.toml"
    heir.write_text('extends = "elbow_arm.toml"\nname = "long_arm"\nparameters = { a1 = 1 }\n')
    first, own = chasles.find_folder(heir), chasles.find_folder(arm)
    assert chasles.find_folder(heir) == first
    arm.write_text(ARM.replace("a = 0.2", "a = 0.25"))
    assert chasles.find_folder(heir) != first
    assert chasles.find_folder(arm) != own
    assert len(derived(cache)) == 4


@pytest.mark.usefixtures("few", "described_only")
def test_changed_include_of_xacro_is_derived_again(tmp_path, cache):
    xacro = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'
    part = tmp_path / "part.xacro"
    part.write_text(f"<part {xacro}>" + "".join(URDF.splitlines(keepends=True)[1:-1]) + "</part>")
    path = tmp_path / "door.urdf.xacro"
    path.write_text(
        f'<robot name="door" {xacro}><xacro:arg name="file" default="part"/>'
        '<xacro:include filename="$(arg file).xacro"/></robot>'
    )
    first = chasles.load(path)
    assert first.name == "door"
    assert chasles.load(path, arguments=["file:=part"]).digest == first.digest
    assert len(derived(cache)) == 2
    part.write_text(part.read_text().replace("0 0 0.1", "0 0 0.2"))
    changed = chasles.load(path)
    assert changed.digest != first.digest
    part.write_text(part.read_text().replace("0 0 0.2", "0 0 0.1"))
    assert chasles.load(path).folder == first.folder


@pytest.mark.usefixtures("few")
def test_copy_of_a_description_shares_its_folder_unless_its_includes_differ(arm, tmp_path):
    heir = tmp_path / "long_arm.toml"
    heir.write_text('extends = "elbow_arm.toml"\nname = "long_arm"\nparameters = { a1 = 1 }\n')
    first = chasles.find_folder(heir)
    other = tmp_path / "other"
    other.mkdir()
    for file in (heir, arm):
        shutil.copy(file, other)
    assert chasles.find_folder(other / heir.name) == first
    (other / arm.name).write_text(ARM.replace("a = 0.2", "a = 0.25"))
    assert chasles.find_folder(other / heir.name) != first


@pytest.mark.usefixtures("few", "described_only")
def test_links_and_name_are_selected_by_load(tmp_path):
    path = tmp_path / "door.urdf"
    more = '<link name="knob"/><joint name="turn" type="continuous">'
    more += '<parent link="lid"/><child link="knob"/></joint></robot>'
    path.write_text(URDF.replace("</robot>", more))
    groups = '<robot name="door"><group name="short"><chain base_link="base" tip_link="lid"/>'
    (tmp_path / "door.srdf").write_text(f"{groups}</group></robot>")
    assert chasles.load(path).n == 2
    short = chasles.load(path, tip="lid", name="mine")
    assert (short.n, short.name) == (1, "mine")
    # An inverse kinematics function for fixed joints is derived from the chain of the loaded robot.
    origin = (path, ("--tip", "lid", "--name", "mine"))
    assert described.description_of(short.folder) == origin
    assert chasles.load(path, group="short").n == 1
    assert chasles.load(path, base="lid").n == 1
    with pytest.raises(chasles.DerivationError, match="found 'no_link'"):
        chasles.load(path, tip="no_link")
    with pytest.raises(
        chasles.InputValueError, match="expected a description for --tip lid, got a folder"
    ):
        chasles.load(short.folder, tip="lid")


@pytest.mark.usefixtures("few")
def test_mjcf_model_loads_from_its_path(tmp_path):
    pytest.importorskip("mujoco")
    path = tmp_path / "arm.xml"
    path.write_text(
        '<mujoco model="swing"><worldbody><body name="a" pos="0 0 0.5"><joint name="j"/>'
        "</body></worldbody></mujoco>"
    )
    assert chasles.load(path).fk([0.0])[2, 3] == 0.5


@pytest.mark.parametrize("name", ["UR5e", "ur5-e"])
def test_other_spelling_of_a_robot_name_is_suggested(name):
    with pytest.raises(chasles.UnknownRobotError, match=r"did you mean ur5e\?"):
        chasles.load(name)


@pytest.mark.usefixtures("few")
def test_invalid_description_error_names_cause(arm, tmp_path, cache):
    arm.write_text(ARM.replace('"a1"', '"a2"'))
    with pytest.raises(chasles.DerivationError, match=r"elbow_arm.toml:4: joints\[1\].a: expected"):
        chasles.load(arm)
    fork = tmp_path / "fork.urdf"
    fork.write_text(URDF.replace("<joint", '<link name="flap"/><joint', 1))
    with pytest.raises(chasles.DerivationError, match="a choice of the base link"):
        chasles.load(fork)
    assert derived(cache) == []
    two = tmp_path / "two.urdf"
    more = URDF.replace('name="lid"', 'name="flap"').replace('"lid"', '"flap"')
    two.write_text(
        URDF.replace(
            "</robot>",
            more.split('<link name="base"/>')[1].replace(
                'joint name="hinge"', 'joint name="second"'
            ),
        )
    )
    for _ in range(2):
        with pytest.raises(
            chasles.UnknownRobotError,
            match=r"\(hinge_flap, hinge_lid\); before chasles.load\('./robots/hinge_flap'\), "
            "run chasles derive",
        ):
            chasles.load(two)
    shutil.rmtree(cache)
    with pytest.raises(
        chasles.UnknownRobotError, match=r"none.toml: cannot read the file \(No such"
    ):
        chasles.load("none.toml")
    with pytest.raises(chasles.UnknownRobotError, match=r"did you mean .*ur10e.*on first use: cr5"):
        chasles.load("ur10f")
    other = tmp_path / "arm.txt"
    other.write_text(ARM)
    with pytest.raises(chasles.UnknownRobotError, match=r"expected a description \(\.toml, \.urdf"):
        chasles.load(other)


@pytest.mark.usefixtures("few")
def test_concurrent_first_loads_share_derived_robot(arm, cache, tmp_path, monkeypatch):
    """Both threads derive the robot at the same time, as two processes would."""
    made, barrier = tmp_path / "made", threading.Barrier(2, timeout=SECONDS)
    described._run_compiler(arm, made, ())

    def run_with_the_other(description, folder, options):
        barrier.wait()
        shutil.copytree(made, folder)
        barrier.wait()

    monkeypatch.setattr(described, "_run_compiler", run_with_the_other)
    with ThreadPoolExecutor(2) as pool:
        folders = list(pool.map(chasles.find_folder, [arm, arm]))
    assert set(folders) == {chasles.find_folder(arm)}
    assert len(derived(cache)) == 1


@pytest.mark.usefixtures("few", "described_only")
def test_interrupted_derivation_leaves_no_loadable_robot(arm, cache):
    process = finding(arm)
    until(lambda: (cache / "derived").is_dir() and any((cache / "derived").iterdir()))
    os.killpg(process.pid, signal.SIGKILL)
    process.communicate()
    assert all(name.startswith(".") for name in derived(cache))
    assert chasles.load(arm).name == "elbow_arm"


@pytest.mark.usefixtures("few")
def test_description_changed_during_derivation_is_rejected(arm, cache):
    def run_and_change(command):
        done = derived_here(command)
        arm.write_text(ARM.replace("a = 0.2", "a = 0.25"))
        return done

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(described, "_finished", run_and_change)
        with pytest.raises(
            chasles.DerivationError, match="file changed while chasles derived the robot"
        ):
            chasles.find_folder(arm)
    assert derived(cache) == []
    shutil.rmtree(chasles.find_folder(arm))
    with pytest.raises(chasles.CacheError, match="robot files are missing; delete this folder"):
        chasles.find_folder(arm)


def test_derivation_ignores_modules_in_working_directory(arm, tmp_path, monkeypatch):
    derive_few(monkeypatch, FEW)
    (tmp_path / "typing.py").write_text("raise RuntimeError\n")
    monkeypatch.chdir(tmp_path)
    assert chasles.find_folder(arm).is_dir()


def test_unwritable_cache_error_names_environment_variable(arm, tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("CHASLES_CACHE", str(tmp_path / "file"))
    with pytest.raises(chasles.CacheError, match="set CHASLES_CACHE to a writable"):
        chasles.load(arm)


@pytest.fixture
def bare(tmp_path, monkeypatch):
    """Create an environment that contains only chasles and NumPy."""
    folder = tmp_path / "bare"
    venv.create(folder, symlinks=True, with_pip=False)
    package = tmp_path / "site" / "chasles"
    package.mkdir(parents=True)
    for path in (*(ROOT / "runtime").iterdir(), ROOT / "contract"):
        (package / path.name).symlink_to(path)
    (package / "cli").symlink_to(ROOT / "apps" / "cli")
    shutil.copytree(ROOT / "derive", package / "derive")
    numpy = Path(np.__file__).parent
    for path in numpy.parent.glob("numpy*"):
        (package.parent / path.name).symlink_to(path)
    monkeypatch.setenv("PYTHONPATH", str(package.parent))
    return folder / "bin" / "python", package


@pytest.mark.usefixtures("few")
def test_missing_derivation_compiler_gives_install_hint(arm, cache, bare):
    python, package = bare
    process = finding("ur10e", python)
    _, err = process.communicate()
    assert process.returncode == 1
    assert "DerivationError" in err
    hint = "typer is not installed: pip install 'chasles[derive]'"
    assert f"ur10e.toml: cannot derive the robot; {hint}" in err
    assert derived(cache) == []
    here = chasles.find_folder(arm)
    process = finding(arm, python)
    assert process.communicate() == (f"{here}\n", "")
    with (package / "derive" / "derivation.py").open("a") as file:
        file.write("# changed\n")
    process = finding(arm, python)
    assert hint in process.communicate()[1]


def test_list_command_shows_generated_and_shelf_robots(capsys):
    assert main(["list"]) == 0
    text = capsys.readouterr().out
    generated, _, shelf = text.partition("derived on first use:")
    assert "ur5e                     Universal Robots UR5e" in generated
    assert "tx2_60                   Stäubli TX2-60" in shelf
    assert len(shelf.split("\n")) - 2 == len(chasles.shelf_robots())
    assert main(["list", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)
    assert list(listed["generated"]) == chasles.robots()
    assert listed["derived_on_first_use"]["tx2_60"] == "Stäubli TX2-60"


@pytest.mark.usefixtures("few")
def test_info_command_prints_the_manifest_of_the_chosen_chain(tmp_path, capsys):
    path = tmp_path / "door.urdf"
    more = '<link name="knob"/><joint name="turn" type="continuous">'
    more += '<parent link="lid"/><child link="knob"/></joint></robot>'
    path.write_text(URDF.replace("</robot>", more))
    assert main(["info", str(path), "--tip", "lid", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["frames"]["tip"] == "lid"
