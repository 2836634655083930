"""Faults during compilation leave one error and no partial file.

After a fault during compilation, a second call of the interrupted command succeeds.
"""

import os
import shutil
import signal
import subprocess
import sys

import numpy as np
import pytest

import chasles
from chasles.derive import read, write
from chasles.library import derived as described
from tests.support.command_line import run
from tests.support.compiling import COMPILER, TCC, derived_here
from tests.support.faults import check_writes, killed, steps_of
from tests.support.handwritten import tiny
from tests.support.waiting import until

ARM = """\
name = "elbow_arm"
convention = "dh"
joints = [{ a = 0.3 }, { a = 0.2 }]
"""
Q = [0.3, -1.2]
FEW = ("--functions", "fk", "--languages", "c", "--jobs", "1")
LOAD = "import sys, chasles; chasles.load(sys.argv[1])"
KILLS = 8
"""Number of trials."""


@pytest.fixture(autouse=True)
def fast(cache, monkeypatch):
    """Set an empty cache and compiler flags for fast compilation."""
    monkeypatch.setenv("CHASLES_CFLAGS", "-O0")
    if compiler := TCC or COMPILER:
        monkeypatch.setenv("CC", compiler)
    cache.mkdir(mode=0o700)


@pytest.fixture
def arm(tmp_path):
    path = tmp_path / "elbow_arm.toml"
    path.write_text(ARM)
    return path


@pytest.fixture
def here(monkeypatch):
    """Run the compiler of chasles in the test process, and derive only forward kinematics."""
    run_compiler = described._run_compiler
    monkeypatch.setattr(described, "_finished", derived_here)
    monkeypatch.setattr(
        described, "_run_compiler", lambda file, to, words: run_compiler(file, to, (*words, *FEW))
    )


def command(*words):
    """Run a command.

    If the command fails, check that its error message has a single line, and raise the message as
    an error.
    """
    done = run(*words)
    assert "Traceback" not in done.output
    if done.exit_code:
        assert len(done.stderr.splitlines() or done.stdout.splitlines()) == 1, done.output
        raise chasles.ChaslesError(done.output)


def test_compilation_survives_every_fault(folder, cache):
    check_writes(lambda: chasles.load(folder.path), cache)
    np.testing.assert_allclose(chasles.load(folder.path).fk(Q), tiny.fk(Q), rtol=1e-14)


def test_build_command_survives_every_fault(folder, cache):
    check_writes(lambda: command("build", folder.path), cache)


def test_written_robot_survives_every_fault(arm, tmp_path):
    def write_arm():
        return write(read(arm), tmp_path / "out" / "arm", functions=["fk"], languages=["c"])

    write_arm()
    arm.write_text(ARM.replace("0.3", "0.4"))
    check_writes(write_arm, tmp_path / "out")
    assert chasles.load(tmp_path / "out" / "arm").fk([0, 0])[0, 3] == pytest.approx(0.6)


def test_every_file_of_a_robot_is_written_before_the_first_is_moved(arm, tmp_path):
    """If the disk is full, the folder of the robot must not contain files of two derivations."""
    robot, folder = read(arm), tmp_path / "out" / "arm"
    steps = steps_of(lambda: write(robot, folder, functions=["fk"], languages=["c"]), folder)
    kinds = [step.split()[0] for step in steps]
    first_move = kinds.index("os.rename")
    assert kinds.count("os.rename") > 2
    assert "open" in kinds[:first_move]
    assert "open" not in kinds[first_move:]


def test_derive_command_survives_every_fault(arm, tmp_path):
    command("derive", arm, "--to", tmp_path / "out", *FEW)
    arm.write_text(ARM.replace("0.3", "0.4"))
    check_writes(lambda: command("derive", arm, "--to", tmp_path / "out", *FEW), tmp_path / "out")


def test_portable_folder_survives_every_fault(folder, tmp_path, monkeypatch):
    monkeypatch.setenv("CC", COMPILER or "gcc")
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "tiny").mkdir(parents=True)
    words = ("build", folder.path, "--portable", tmp_path / "out")
    check_writes(lambda: command(*words), tmp_path / "out")


@pytest.mark.usefixtures("here")
def test_derivation_into_the_cache_survives_every_fault(arm, cache):
    (cache / "derived").mkdir(mode=0o700)
    check_writes(lambda: chasles.find_folder(arm), cache)


def test_compilation_that_was_killed_leaves_nothing_for_the_next(folder, cache, monkeypatch):
    compiler = folder.path.parent / "endless"
    compiler.write_text("#!/bin/sh\nexec sleep 600\n")
    compiler.chmod(0o755)
    environment = {**os.environ, "CC": str(compiler)}
    process = started(folder.path, environment)
    until(lambda: list(cache.glob(".chasles-tiny-*/chasles_glue.c")))
    assert chasles.load(folder.path).name == "tiny"
    assert len(list(cache.glob(".chasles-tiny-*"))) == 1
    kill(process)
    (library,) = cache.glob("*.so")
    library.unlink()
    chasles.load(folder.path)
    assert list(cache.iterdir()) == [library]


@pytest.mark.usefixtures("here")
def test_load_works_after_a_kill_at_any_moment(arm, cache):
    steps = steps_of(lambda: chasles.load(arm), cache)
    for step in np.linspace(0, len(steps) - 1, KILLS).astype(int):
        shutil.rmtree(cache)
        killed(step, lambda: chasles.load(arm), cache)
        assert chasles.load(arm).fk([0, 0])[0, 3] == pytest.approx(0.5)
        # After the next load, no temporary folder of the killed process remains.
        assert not list(cache.rglob(".chasles-*")), steps[step]


def started(path, environment=None):
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL, "text": True}
    command = [sys.executable, "-c", LOAD, str(path)]
    return subprocess.Popen(command, start_new_session=True, env=environment, **pipes)


def kill(process):
    os.killpg(process.pid, signal.SIGKILL)
    process.communicate()
