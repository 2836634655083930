"""Robots derived on first use: the shelf, descriptions, concurrent and interrupted first uses."""

import os
import pickle
import re
import shutil
import signal
import subprocess
import sys
import venv
from pathlib import Path

import numpy as np
import pytest

import chasles
from chasles.cli import main
from chasles.derive import read_text
from chasles.library import derived as described
from tests.support.compiling import compiled
from tests.support.waiting import until

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
"""Options of the compiler: a robot of one function is derived several times faster."""
FIND = f"""\
import sys, chasles
from chasles.library import derived as described
run = described._run_compiler
described._run_compiler = lambda file, folder, options: run(file, folder, (*options, *{FEW}))
print(chasles.find_folder(sys.argv[1]))
"""


@pytest.fixture(autouse=True)
def fast(cache, monkeypatch):
    """An empty cache, and C that is compiled quickly."""
    monkeypatch.setenv("CHASLES_CFLAGS", "-O0")


@pytest.fixture
def here(monkeypatch, compiler_in_process):
    """The compiler runs in this process."""
    monkeypatch.setattr(subprocess, "run", compiler_in_process)


@pytest.fixture
def few(monkeypatch, here):
    """The compiler runs in this process, and derives forward kinematics alone."""
    derive_few(monkeypatch, FEW)


def derive_few(monkeypatch, functions):
    """Makes the runtime call the compiler with further options."""
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
    with pytest.raises(chasles.DerivationError, match="without chasles_ at its start"):
        chasles.load(path)


@pytest.fixture
def arm(tmp_path):
    path = tmp_path / "elbow_arm.toml"
    path.write_text(ARM)
    return path


def derived(cache):
    """Folders of derived robots, and whatever else lies beside them."""
    return sorted(path.name for path in (cache / "derived").iterdir())


def finding(robot, python=sys.executable):
    """A process of its own that looks for a robot's folder."""
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    return subprocess.Popen([python, "-c", FIND, str(robot)], start_new_session=True, **pipes)


@pytest.mark.usefixtures("here")
def test_shelf_robot_is_derived_once_on_first_use(cache, capfd, monkeypatch):
    derive_few(monkeypatch, ("--functions", "fk,fk_jacobian_mixed,ik"))
    assert "xarm5" in chasles.shelf_robots()
    robot = chasles.load("xarm5")
    assert capfd.readouterr().err == "chasles: deriving xarm5 once, a few seconds ...\n"
    q = np.array([0.1, -0.5, -1.2, 0.9, 0.4])
    found = robot.ik(robot.fk(q))
    assert np.abs(found.q[found.valid] - q).max(axis=-1).min() < 1e-9
    pickled = pickle.dumps(robot.fk)
    assert str(cache).encode() not in pickled
    np.testing.assert_array_equal(pickle.loads(pickled)(q), robot.fk(q))
    assert chasles.load("xarm5") == robot
    assert capfd.readouterr().err == ""
    assert len(derived(cache)) == 1


@pytest.mark.usefixtures("here")
def test_derivation_message_mentions_parametric_functions(arm, capfd):
    robot = chasles.load(arm, parametric=True)
    said = "chasles: deriving elbow_arm with parametric functions once, a few seconds ...\n"
    assert capfd.readouterr().err == said
    assert "fk_p" in robot.functions
    assert chasles.find_folder(arm, parametric=True) == robot.folder


def test_shelf_names_are_disjoint_from_generated_robots():
    assert len(chasles.shelf_robots()) >= 35
    assert not set(chasles.shelf_robots()) & set(chasles.robots())


@pytest.mark.usefixtures("few")
def test_robot_file_and_urdf_load_from_path_strings(arm, tmp_path, monkeypatch):
    (tmp_path / "door.urdf").write_text(URDF)
    monkeypatch.chdir(tmp_path)
    assert chasles.load("elbow_arm.toml").name == chasles.load(arm).name == "elbow_arm"
    assert chasles.load("door.urdf").tip_frame == "lid"


@pytest.mark.usefixtures("few")
def test_warnings_of_the_compiler_are_warnings_of_load(arm):
    arm.write_text(ARM.replace('{ a = "a1" }', '{ a = "a1", alpha = "1.57" }').replace("0.2", "2"))
    with pytest.warns(UserWarning, match=r"^/.*elbow_arm\.toml: exact numbers .* --exact"):
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


def test_changed_nominal_file_is_derived_again(tmp_path, cache):
    design = (ROOT / "derive" / "robots" / "four_bar.toml").read_text()
    (tmp_path / "design.toml").write_text(design)
    built = tmp_path / "built.toml"
    built.write_text(design.replace("units =", 'nominal = "design.toml"\nunits =', 1))
    heir = tmp_path / "heir.toml"
    heir.write_text('extends = "built.toml"\nname = "heir"\n')
    first = [described._home(path) for path in (built, heir)]
    (tmp_path / "design.toml").write_text(design + "\n")
    second = [described._home(path) for path in (built, heir)]
    assert all(a != b for a, b in zip(first, second, strict=True))


@pytest.mark.parametrize("room", ["shipped", "shelf"])
def test_changed_installed_nominal_robot_is_derived_again(room, tmp_path, monkeypatch):
    design = tmp_path / "installed.toml"
    design.write_text((ROOT / "derive" / "robots" / "four_bar.toml").read_text())
    monkeypatch.setattr(described, room, lambda: {"mine": design})
    built = tmp_path / "built.toml"
    built.write_text(design.read_text().replace("units =", 'nominal = "mine"\nunits =', 1))
    first = described._home(built)
    design.write_text(design.read_text() + "\n")
    assert described._home(built) != first


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
            chasles.UnknownRobotError, match=r"\(hinge_flap, hinge_lid\); derive them"
        ):
            chasles.load(two)
    shutil.rmtree(cache)
    with pytest.raises(chasles.UnknownRobotError, match=r"none.toml: cannot be read \(No such"):
        chasles.load("none.toml")
    with pytest.raises(chasles.UnknownRobotError, match=r"did you mean .*ur10e.*on first use: cr5"):
        chasles.load("ur10f")
    other = tmp_path / "arm.txt"
    other.write_text(ARM)
    with pytest.raises(chasles.UnknownRobotError, match=r"expected a description, .toml or .urdf"):
        chasles.load(other)
    for name in ("arm.xacro", "arm.xml"):
        (tmp_path / name).write_text(URDF)
        with pytest.raises(chasles.UnknownRobotError, match="chasles-derive FILE --to robots"):
            chasles.load(tmp_path / name)


def test_concurrent_first_loads_share_derived_robot(arm, cache):
    processes = [finding(arm) for _ in range(3)]
    said = [process.communicate() for process in processes]
    assert [process.returncode for process in processes] == [0, 0, 0], said
    assert {out for out, _ in said} == {f"{chasles.find_folder(arm)}\n"}
    assert len(derived(cache)) == 1
    # At least two of them derived the robot: neither waited for the other.
    assert sum("deriving" in err for _, err in said) >= 2


@pytest.mark.usefixtures("few")
def test_interrupted_derivation_leaves_no_loadable_robot(arm, cache):
    process = finding(arm)
    until(lambda: (cache / "derived").is_dir() and any((cache / "derived").iterdir()))
    os.killpg(process.pid, signal.SIGKILL)
    process.communicate()
    assert all(name.startswith(".") for name in derived(cache))
    assert chasles.load(arm).name == "elbow_arm"


@pytest.mark.usefixtures("few")
def test_description_changed_during_derivation_is_rejected(arm, cache):
    run = subprocess.run

    def run_and_change(command, **options):
        done = run(command, **options)
        arm.write_text(ARM.replace("a = 0.2", "a = 0.25"))
        return done

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(subprocess, "run", run_and_change)
        with pytest.raises(chasles.DerivationError, match="changed while it was derived"):
            chasles.find_folder(arm)
    assert derived(cache) == []
    shutil.rmtree(chasles.find_folder(arm))
    with pytest.raises(chasles.CacheError, match="holds no robot any more; delete this folder"):
        chasles.find_folder(arm)


def test_derivation_ignores_modules_in_working_directory(arm, tmp_path, monkeypatch):
    derive_few(monkeypatch, FEW)
    (tmp_path / "typing.py").write_text("raise RuntimeError\n")
    monkeypatch.chdir(tmp_path)
    assert chasles.find_folder(arm).is_dir()


def test_unwritable_cache_error_names_environment_variable(arm, tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("CHASLES_CACHE", str(tmp_path / "file"))
    with pytest.raises(chasles.CacheError, match="set CHASLES_CACHE to a folder that can be"):
        chasles.load(arm)


@pytest.fixture
def bare(tmp_path, monkeypatch):
    """An environment with chasles and NumPy alone, and a compiler that may be changed."""
    folder = tmp_path / "bare"
    venv.create(folder, symlinks=True, with_pip=False)
    package = tmp_path / "site" / "chasles"
    package.mkdir(parents=True)
    for path in (*(ROOT / "runtime").iterdir(), ROOT / "contract"):
        (package / path.name).symlink_to(path)
    shutil.copytree(ROOT / "derive", package / "derive")
    numpy = Path(np.__file__).parent
    for path in numpy.parent.glob("numpy*"):
        (package.parent / path.name).symlink_to(path)
    monkeypatch.setenv("PYTHONPATH", str(package.parent))
    return folder / "bin" / "python", package


def test_missing_derivation_compiler_gives_install_hint(arm, cache, bare):
    python, package = bare
    process = finding("ur10e", python)
    _, err = process.communicate()
    assert process.returncode == 1
    assert "DerivationError" in err
    assert (
        "ur10e.toml: cannot be derived; the compiler is not installed: pip install 'chasles[" in err
    )
    assert derived(cache) == []
    # A robot that was derived before needs no compiler, until the compiler changes.
    process = finding(arm)
    here = process.communicate()
    process = finding(arm, python)
    assert process.communicate() == (here[0], "")
    with (package / "derive" / "derivation.py").open("a") as file:
        file.write("# changed\n")
    process = finding(arm, python)
    assert "the compiler is not installed" in process.communicate()[1]


def test_list_command_shows_generated_and_shelf_robots(capsys):
    assert main(["list"]) == 0
    text = capsys.readouterr().out
    generated, _, shelf = text.partition("derived on first use:")
    assert "ur5e                     Universal Robots UR5e" in generated
    assert "tx2_60                   Stäubli TX2-60" in shelf
    assert len(shelf.split("\n")) - 2 == len(chasles.shelf_robots())
