"""Shell completion works, and a pipe receives each line as soon as it is printed."""

import os
import subprocess
import sys

import pytest

from tests.support.waiting import SECONDS


def completed(line):
    """Returns the words that complete a command line."""
    asked = {"_ARGCOMPLETE": "1", "_ARGCOMPLETE_IFS": "\n", "COMP_LINE": line}
    environment = os.environ | asked | {"COMP_POINT": str(len(line)), "COMP_TYPE": "9"}
    read, write = os.pipe()
    command = f"import os; os.dup2({write}, 8); os.dup2(2, 9); from chasles.cli import main; "
    subprocess.run(
        [sys.executable, "-c", f"{command}main([])"],
        env=environment,
        pass_fds=[write],
        check=True,
        timeout=SECONDS,
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
    ids=["command", "option", "robot", "robot option"],
)
def test_shell_completes_commands_options_and_robots(line, words):
    assert sorted(completed(line)) == words


def test_shell_completes_file_names(tmp_path):
    (tmp_path / "measured.csv").touch()
    assert completed(f"chasles calibrate {tmp_path}/mea") == [f"{tmp_path}/measured.csv"]


def test_derive_command_completes_robot_names():
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
        timeout=SECONDS,
    )
    assert found.stdout.split() == ["panda"]


def test_derive_progress_is_flushed_to_pipe_immediately(tmp_path):
    command = [sys.executable, "-m", "chasles.derive", "four_bar", "scara"]
    command += ["--to", str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "deriving 2 robots\n"
        assert process.poll() is None
        process.terminate()


def test_runtime_output_is_flushed_line_by_line():
    run = "import chasles.cli as m, os; m.main(['list']); os._exit(0)"
    found = subprocess.run(
        [sys.executable, "-c", run], capture_output=True, text=True, check=True, timeout=SECONDS
    )
    assert "ur5e" in found.stdout
