"""The package chasles-robots contains robots that load without a compiler."""

import pickle
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

import chasles
from chasles.library.derived import description_of, shelf
from tests.support.command_line import run
from tests.support.handwritten import tiny
from tests.support.without_compiler import started

ROOT = Path(__file__).parents[3]
LOAD_BY_NAME = """
import chasles
robot = chasles.load("tiny")
print(robot.folder, *robot.fk([0.3, 0.5]).ravel())
"""


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    """Create a package with one robot on the module search path."""
    base = tmp_path_factory.mktemp("robots")
    folder = tiny.Folder(base / "own" / "tiny", tiny.manifest())
    folder.write(tiny.SOURCE)
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("CC", raising=False)
        patch.setenv("CHASLES_CFLAGS", "-O0")
        done = run("build", str(folder.path), "--portable", str(base / "site" / "chasles_robots"))
    assert done.exit_code == 0, done.output
    return base / "site"


@pytest.fixture
def installed(package, monkeypatch):
    monkeypatch.syspath_prepend(str(package))
    monkeypatch.delitem(sys.modules, "chasles_robots", raising=False)
    return package / "chasles_robots"


def test_robot_of_package_loads_by_name_without_compiler(package, tmp_path):
    done = started(LOAD_BY_NAME, cache=tmp_path / "cache", path=package)
    assert done.returncode == 0, done.stderr
    folder, *values = done.stdout.split()
    assert folder == str(package / "chasles_robots" / "tiny")
    expected = tiny.fk(np.array([0.3, 0.5])).ravel()
    np.testing.assert_allclose(np.array(values, float), expected, atol=1e-15)
    assert not (tmp_path / "cache").exists()


def test_robots_lists_the_package(installed):
    assert "tiny" in chasles.robots()


def test_robot_of_package_is_pickled_by_name(installed):
    robot = chasles.load("tiny")
    assert str(installed).encode() not in pickle.dumps(robot)
    assert pickle.loads(pickle.dumps(robot)) == robot


def test_arm_of_package_is_not_derived_on_first_use(installed):
    arm = installed / "ur10e"
    arm.mkdir()
    try:
        (arm / "manifest.json").touch()
        assert "ur10e" in chasles.robots()
        assert "ur10e" not in chasles.shelf_robots()
        assert chasles.find_folder("ur10e") == arm
        assert description_of(arm) == (shelf()["ur10e"], ())
    finally:
        (arm / "manifest.json").unlink()
        arm.rmdir()


def test_package_requires_the_version_of_chasles_of_its_kernels():
    own, main = (
        tomllib.loads((ROOT / folder / "pyproject.toml").read_text(encoding="utf-8"))["project"]
        for folder in ("packages/robots", "")
    )
    assert own["version"] == main["version"]
    assert own["dependencies"] == [f"chasles=={main['version']}"]
