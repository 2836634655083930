"""Robots: loading, attributes, pickling, generated packages, manifests and the command line."""

import ast
import copy
import math
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import chasles
import chasles.robot
from chasles.cli.app import run as main
from tests.support.handwritten import tiny

Q = np.array([0.3, -1.2])


@pytest.fixture
def shipped(folder, monkeypatch):
    """Make the test robot `tiny` loadable by name, like an installed robot."""
    folders = {"tiny": folder.path}
    for module in (chasles, chasles.robot, chasles.library.folders):
        monkeypatch.setattr(module, "shipped_folders", lambda: folders)
    return folder


def test_loaded_robot_exposes_manifest_facts(robot):
    assert (robot.name, robot.title, robot.n) == ("tiny", "A tiny robot", 2)
    assert [c.name for c in robot.coordinates] == ["pan", "lift"]
    np.testing.assert_array_equal(robot.lower, [-3, -np.inf])
    np.testing.assert_array_equal(robot.upper, [3, np.inf])
    assert robot.link_names == ("link1", "link2")
    assert robot.parameters["d1"].exact == "13/80"
    assert robot.notes == ("Not to be built.",)
    assert list(robot.functions) == ["fk", "blend", "fused", "distance", "wide"]
    assert robot.functions["fk"] is robot.fk
    assert "A tiny robot" in repr(robot)
    assert "lift [m]" in repr(robot)


def test_loaded_robot_is_immutable(robot):
    with pytest.raises(AttributeError, match="is immutable"):
        robot.name = "other"
    with pytest.raises(AttributeError, match="is immutable"):
        del robot.fk
    with pytest.raises(ValueError, match="read-only"):
        robot.lower[0] = 1
    with pytest.raises(TypeError):
        robot.functions["fk"] = None


def test_missing_function_error_names_nearest_functions(robot):
    with pytest.raises(
        AttributeError, match=r"robot 'tiny' has no 'ik'; .*nearest functions: fk, "
    ):
        robot.ik(Q)
    assert not hasattr(robot, "hessian_mixed")


def test_robot_and_functions_survive_pickling(robot, monkeypatch):
    monkeypatch.delenv("CHASLES_CFLAGS", raising=False)
    again = pickle.loads(pickle.dumps(robot))
    assert again == robot
    assert hash(again) == hash(robot)
    assert copy.deepcopy(robot) == robot
    function = pickle.loads(pickle.dumps(robot.fk))
    np.testing.assert_array_equal(function(Q), robot.fk(Q))
    assert robot != "tiny"


def test_unpickling_changed_robot_is_rejected(folder):
    pickled = pickle.dumps(chasles.load(folder.path))
    folder.write(tiny.SOURCE.replace("sin", "cos"))
    with pytest.raises(chasles.MismatchError, match="differs from the pickled robot tiny"):
        pickle.loads(pickled)


def test_shipped_robot_pickles_by_name(shipped):
    pickled = pickle.dumps(chasles.load("tiny"))
    assert str(shipped.path).encode() not in pickled
    assert pickle.loads(pickled).name == "tiny"


def test_robot_loads_by_name_and_by_path(shipped):
    assert chasles.robots() == ["tiny"]
    assert chasles.load("tiny") == chasles.load(shipped.path) == chasles.load(f"{shipped.path}/")


def test_unknown_robot_error_suggests_names(shipped, tmp_path):
    with pytest.raises(
        chasles.UnknownRobotError, match=r"'tinny'; did you mean tiny\? known: tiny"
    ):
        chasles.load("tinny")
    with pytest.raises(
        chasles.UnknownRobotError, match=r"known: tiny; to load a folder, .* './zebra'"
    ):
        chasles.load("zebra")
    with pytest.raises(
        chasles.UnknownRobotError, match=r"folder of a generated robot \(no manifest.json in it\)"
    ):
        chasles.load(tmp_path)


# -------------------------------------------------------------- manifest


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda m: m.update(chasles=1),
            r"chasles: this version .* reads manifests of format 2, got 1; derive the robot again",
        ),
        (lambda m: m.update(kind="arm"), r'kind: got \'arm\', expected "serial" or "hybrid"'),
        (lambda m: m["functions"][0].pop("role"), r"functions\[0\]: has no 'role'"),
        (lambda m: m.pop("tolerances"), r"has no 'tolerances'"),
        (lambda m: m.pop("name"), r"has no 'name'"),
        (lambda m: m.update(name="a b"), r"name: got 'a b', expected a name of"),
        (lambda m: m.update(title=3), r"title: got 3, expected a string"),
        (lambda m: m.update(functions={}), r"functions: got {}, expected a list"),
        (lambda m: m.update(frames=[]), r"frames: got \[\], expected an object"),
        (lambda m: m["coordinates"][1].update(lower="0"), r"coordinates\[1\].lower: got '0'"),
        (lambda m: m["parameters"][0].update(value=True), r"parameters\[0\].value: got True"),
        (lambda m: m["parameters"][0].update(value=10**400), r"parameters\[0\].value: got 10"),
        (lambda m: m["parameters"][0].update(value=math.nan), r"parameters\[0\].value: got nan"),
        (
            lambda m: m["functions"][1]["inputs"][1].update(shape=[2**40]),
            r"inputs\[1\].shape\[0\]: got 1099511627776, expected a count",
        ),
        (
            lambda m: m["functions"][0].update(symbol="f();x"),
            r"functions\[0\].symbol: got 'f\(\);x'",
        ),
        (lambda m: m["functions"][0].update(outputs=[]), r"functions\[0\]: .* at least one input"),
        (
            lambda m: m["functions"][1]["inputs"][1].update(shape=[2, -3]),
            r"functions\[1\].inputs\[1\].shape\[1\]: got -3, expected a count",
        ),
        (
            lambda m: m["functions"][1]["inputs"][1].update(shape=[0]),
            r"expected sizes of at least 1",
        ),
        (lambda m: m["functions"][1]["inputs"][1].update(name="q"), r"'q' occurs twice"),
        (lambda m: m["functions"][1]["inputs"][1].update(name="out"), r"'out' occurs twice"),
        (lambda m: m["functions"][1].update(name="fk"), r"functions: 'fk' occurs twice"),
        (lambda m: m["functions"][0]["operations"].update(add=-1), r"operations.add: got -1"),
        (lambda m: m["files"].pop("tiny.h"), r"files: missing 'tiny.h'"),
        (lambda m: m["files"].update({"tiny.c": "zz"}), r"files.tiny.c: got 'zz', expected a SHA"),
    ],
    ids=[
        "old format",
        "unknown kind",
        "role missing",
        "tolerances missing",
        "name missing",
        "invalid name",
        "title not text",
        "functions not list",
        "frames not object",
        "limit not number",
        "value not number",
        "value beyond a double",
        "value NaN",
        "size beyond an int",
        "invalid symbol",
        "no outputs",
        "negative size",
        "zero size",
        "duplicate input",
        "reserved input name",
        "duplicate function",
        "negative count",
        "file missing",
        "invalid hash",
    ],
)
def test_wrong_manifest_names_file_field_and_value(folder, change, message):
    change(folder.manifest)
    folder.write_manifest()
    with pytest.raises(chasles.ManifestError, match=rf"manifest\.json: .*{message}"):
        chasles.load(folder.path)


@pytest.mark.parametrize(
    "name",
    ["../a.c", "/a.c", "latex/../../a.c", "a//b.c", "", "C:a.c", "..\\a.c", "a\0b"],
)
def test_manifest_names_no_file_outside_its_folder(name, folder):
    folder.manifest["files"][name] = "0" * 64
    folder.write_manifest()
    with pytest.raises(chasles.ManifestError) as caught:
        chasles.load(folder.path)
    assert f"files: got {name!r}, expected a path inside the folder" in str(caught.value)


def test_manifest_without_notes_and_identities_loads(folder):
    del folder.manifest["notes"]
    for function in folder.manifest["functions"]:
        del function["identity"]
    folder.write_manifest()
    assert chasles.load(folder.path).notes == ()


def test_non_json_manifest_is_rejected(folder):
    (folder.path / "manifest.json").write_text("{")
    with pytest.raises(chasles.ManifestError, match=r"manifest.json: not JSON"):
        chasles.load(folder.path)


# ------------------------------------------------------ generated package

INIT = '''\
"""A tiny robot."""

from chasles.lazy_package import lazy_package

__getattr__, __dir__ = lazy_package(globals())
'''


def test_generated_package_loads_robot_lazily(folder, cache):
    (folder.path / "__init__.py").write_text(INIT)
    code = """
import os, sys
import tiny
assert "fk" in dir(tiny) and "robot" in dir(tiny)
assert not hasattr(tiny, "__path_of_nothing__")
assert not os.path.exists(os.environ["CHASLES_CACHE"])
assert tiny.fk([0.0, 1.0]).shape == (3, 4)
assert tiny.n == 2 and tiny.robot.fk is tiny.fk and "fk" in vars(tiny)
from tiny import blend
try:
    tiny.ik
except AttributeError as error:
    assert "nearest functions: fk" in str(error)
else:
    sys.exit("no error")
"""
    subprocess.run([sys.executable, "-c", code], cwd=folder.path.parent, check=True)


# ---------------------------------------------------------- command line


def test_build_command_compiles_once(shipped, capsys, cache):
    assert main(["build"]) == 0
    assert "tiny" in (first := capsys.readouterr().out)
    assert "compiled" in first
    assert main(["build", "tiny"]) == 0
    assert "in the cache" in capsys.readouterr().out
    assert len(list(cache.iterdir())) == 1


def test_build_command_reports_failures(folder, tmp_path, capsys):
    folder.write(tiny.SOURCE + "\nnonsense\n")
    assert main(["build", str(folder.path)]) == 1
    assert "nonsense" in capsys.readouterr().err
    assert main(["build", "zebra"]) == 1
    assert "no robot named 'zebra'" in capsys.readouterr().err


def test_missing_submodule_error_names_its_import():
    code = "import chasles\ntry: chasles.study\nexcept AttributeError as e: print(e)"
    stated = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert stated.stdout.strip().endswith("has no 'study'; import chasles.study")


def test_missing_command_lists_available_commands(capsys):
    assert main([]) == 2
    stated = capsys.readouterr().out
    for command in ("build", "calibrate", "info", "list", "view"):
        assert f" {command} " in stated


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["calibrate", "none.csv", "--robot", "ur5e"], "none.csv: cannot read the table (No such"),
        (["view", "tiny", "--html", "no/folder.html"], "no/folder.html: No such file"),
        (["view", "tiny", "--html", "a.html", "--play", "b.csv"], "omit them with --html"),
    ],
    ids=["missing table", "missing folder", "html with playback"],
)
def test_missing_file_is_reported_without_traceback(
    arguments, words, shipped, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    if arguments[0] == "calibrate":
        monkeypatch.setattr("chasles.cli.calibrating.load", lambda *_, **__: None)
    monkeypatch.setattr("chasles.view.write_html", lambda _, path: path.write_text("page"))
    assert main(arguments) == 1
    stated = capsys.readouterr().err
    assert stated.startswith("chasles: ")
    assert words in stated
    assert not list(tmp_path.glob("*.html"))


def test_info_command_prints_robot_facts(shipped, capsys):
    assert main(["info", "tiny"]) == 0
    text = capsys.readouterr().out
    for part in (
        "A tiny robot",
        "Not to be built.",
        "prismatic  unlimited",
        "blend(q, A)",
    ):
        assert part in text


# ---------------------------------------------- imports between packages


EXTRAS = {
    "calibration": {"scipy", "matplotlib", "threadpoolctl"},
    "drawing": {"matplotlib", "PIL", "imageio_ffmpeg"},
    "view": {"viser", "yourdfpy"},
    "study": {
        *("scipy", "matplotlib", "rich", "networkx", "ruckig", "toppra"),
        *("distributed", "coal", "ompl"),
    },
}
"""Optional packages that each subpackage of the runtime may import in addition to NumPy."""


def test_runtime_imports_numpy_and_the_standard_library_only():
    root = Path(chasles.__file__).parent
    files = list(root.rglob("*.py"))
    assert len(files) > 5
    for file in files:
        # Files in the folders of ``EXTRAS`` may also import the optional packages of their folder.
        extras = (
            modules for room, modules in EXTRAS.items() if root / room in (file, *file.parents)
        )
        allowed = {"numpy", *sys.stdlib_module_names}.union(*extras)
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.Import):
                found = {alias.name.split(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.level == 0:
                found = {(node.module or "").split(".")[0]}
            else:
                continue
            assert found <= allowed, file


def test_import_compiles_nothing_and_imports_only_numpy(cache):
    code = """
import os, sys
import chasles
assert not os.path.exists(os.environ["CHASLES_CACHE"])
assert not {"sympy", "casadi", "scipy", "matplotlib", "rich"} & set(sys.modules)
"""
    subprocess.run([sys.executable, "-c", code], check=True)
    assert chasles.__version__
