"""Shells complete the command lines, and a reader of a pipe sees each line when it is printed."""

import os
import subprocess
import sys

import pytest


def completed(line):
    """The words by which a shell would go on with a line."""
    asked = {"_ARGCOMPLETE": "1", "_ARGCOMPLETE_IFS": "\n", "COMP_LINE": line}
    environment = os.environ | asked | {"COMP_POINT": str(len(line)), "COMP_TYPE": "9"}
    read, write = os.pipe()
    command = f"import os; os.dup2({write}, 8); os.dup2(2, 9); from chasles.__main__ import main; "
    subprocess.run(
        [sys.executable, "-c", f"{command}main([])"],
        env=environment,
        pass_fds=[write],
        check=True,
        timeout=60,
    )
    os.close(write)
    with os.fdopen(read) as answer:
        return [word.strip() for word in answer.read().split("\n")]


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("chasles ca", ["calibrate"]),
        ("chasles view --h", ["--help", "--html"]),
        ("chasles info ur1", ["ur10", "ur10e", "ur16e"]),
        ("chasles calibrate table.csv --robot pan", ["panda"]),
    ],
)
def test_a_shell_completes_commands_options_and_robots(line, words):
    assert sorted(completed(line)) == words


def test_a_shell_completes_files(tmp_path):
    (tmp_path / "measured.csv").touch()
    assert completed(f"chasles calibrate {tmp_path}/mea") == [f"{tmp_path}/measured.csv"]


def test_the_compiler_completes_robots():
    environment = os.environ | {
        "_CHASLES_DERIVE_COMPLETE": "complete_bash",
        "COMP_WORDS": "chasles-derive pan",
        "COMP_CWORD": "1",
    }
    run = "import sys; sys.argv[0] = 'chasles-derive'; from chasles.derive.cli import app; app()"
    found = subprocess.run(
        [sys.executable, "-c", run],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert found.stdout.split() == ["panda"]


def test_a_pipe_hears_at_once_that_robots_are_derived(tmp_path):
    command = [sys.executable, "-m", "chasles.derive", "four_bar", "scara"]
    command += ["--to", str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "deriving 2 robots\n"
        assert process.poll() is None
        process.terminate()


def test_a_pipe_hears_each_line_of_the_runtime():
    run = "import chasles.__main__ as m, os; m.main(['list']); os._exit(0)"
    found = subprocess.run(
        [sys.executable, "-c", run], capture_output=True, text=True, check=True, timeout=60
    )
    assert "ur5e" in found.stdout
