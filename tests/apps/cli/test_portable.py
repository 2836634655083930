"""`chasles build --portable` writes folders that load without a compiler."""

import re
import shutil
import sys

import numpy as np
import pytest

import chasles
from chasles.contract import read_manifest
from chasles.library.cache import make_recipe
from tests.support.command_line import run
from tests.support.handwritten import tiny
from tests.support.without_compiler import started

WITHOUT_COMPILER = """
import sys, numpy as np, chasles
robot = chasles.load(sys.argv[1])
print(*robot.fk(np.array([0.3, 0.5])).ravel())
"""

MODULES = """
import sys, numpy
before = set(sys.modules)
import chasles
chasles.load(sys.argv[1]).fk([0.3, 0.5])
print(*set(sys.modules) - before)
"""
SLOW = {"importlib.metadata", "secrets", "shutil", "subprocess", "tempfile", "tomllib"}
"""Slow modules that startup must not import. Only compilation and error messages need these
modules."""


def written(path, source=tiny.SOURCE):
    folder = tiny.Folder(path, tiny.manifest())
    folder.write(source)
    return folder.path


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    base = tmp_path_factory.mktemp("portable")
    robot = written(base / "own" / "tiny")
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("CC", raising=False)
        patch.setenv("CHASLES_CFLAGS", "-O0")
        done = run("build", str(robot), "--portable", str(base / "out"))
    assert done.exit_code == 0, done.output
    assert "written to" in done.output
    return base / "out" / "tiny"


def test_portable_folder_loads_without_compiler_or_cache(folder, tmp_path):
    moved = shutil.copytree(folder, tmp_path / "moved")
    done = started(WITHOUT_COMPILER, moved, cache=tmp_path / "cache")
    assert done.returncode == 0, done.stderr
    expected = chasles.load(folder).fk([0.3, 0.5])
    np.testing.assert_allclose(np.fromstring(done.stdout, sep=" "), expected.ravel(), atol=1e-15)
    assert not (tmp_path / "cache").exists()


def test_modules_for_compilation_are_not_imported(folder, tmp_path):
    done = started(MODULES, folder, cache=tmp_path / "cache")
    assert done.returncode == 0, done.stderr
    imported = set(done.stdout.split())
    assert "chasles.call._call" in imported
    assert imported & SLOW == set()


def test_kernel_of_other_version_is_refused_with_advice(folder, tmp_path):
    other = shutil.copytree(folder, tmp_path / "tiny")
    again = written(tmp_path / "again" / "tiny", tiny.SOURCE.replace("sin", "cos"))
    for file in again.iterdir():
        shutil.copy(file, other / file.name)
    done = started(WITHOUT_COMPILER, other, cache=tmp_path / "cache")
    assert done.returncode != 0
    refused = (
        "the kernel in this folder was built for another version of chasles or another platform; "
        "install"
    )
    assert f"MismatchError: {other}: {refused}" in done.stderr
    assert chasles.load(other).fk([0.0, 1.0])[0, 0] == 1


def test_portable_folder_is_written_again_with_one_kernel(folder, tmp_path, monkeypatch):
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("CHASLES_CFLAGS", "-O0")
    out = tmp_path / "out"
    (old,) = shutil.copytree(folder, out / "tiny").glob("*.so")
    robot = written(tmp_path / "own" / "tiny", tiny.SOURCE.replace("sin", "cos"))
    assert run("build", str(robot), "--portable", str(out)).exit_code == 0
    (new,) = (out / "tiny").glob("*.so")
    assert new.name != old.name
    before = new.stat()
    assert run("build", str(robot), "--portable", str(out)).exit_code == 0
    assert new.stat() == before  # a repeated build skips finished robots


def test_damaged_kernel_is_rejected(folder, tmp_path, monkeypatch):
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.delenv("CHASLES_CFLAGS", raising=False)
    moved = shutil.copytree(folder, tmp_path / "moved")
    (kernel,) = moved.glob("*.so")
    kernel.write_bytes(kernel.read_bytes()[:-9])
    with pytest.raises(chasles.MismatchError, match="damaged library; install or write"):
        chasles.load(moved)


def test_selected_flags_compile_next_to_a_kernel(folder, monkeypatch):
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.delenv("CHASLES_CFLAGS", raising=False)
    manifest = read_manifest(folder)
    assert make_recipe(manifest).compiler is None
    monkeypatch.setenv("CHASLES_CFLAGS", "-O1")
    assert make_recipe(manifest).compiler is not None


def test_cache_serves_without_compiler(tmp_path, monkeypatch):
    cache = tmp_path / "cache"
    robot = written(tmp_path / "tiny")
    monkeypatch.setenv("CHASLES_CACHE", str(cache))
    expected = chasles.load(robot).fk([0.3, 0.5])
    done = started(WITHOUT_COMPILER, robot, cache=cache)
    assert done.returncode == 0, done.stderr
    np.testing.assert_allclose(np.fromstring(done.stdout, sep=" "), expected.ravel(), atol=1e-15)


@pytest.mark.skipif(sys.platform != "linux", reason="objdump lists symbols of ELF files")
def test_kernel_has_code_for_three_processor_levels(folder):
    (kernel,) = folder.glob("*.so")
    tables = set(re.findall(rb"chasles_kernels(?:_v[34])?\0", kernel.read_bytes()))
    import platform

    expected = {b"chasles_kernels\0"}
    if platform.machine() == "x86_64":
        expected |= {b"chasles_kernels_v3\0", b"chasles_kernels_v4\0"}
    assert tables == expected
