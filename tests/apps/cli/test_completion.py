"""Shell completion works, and a pipe receives each line as soon as it is printed."""

import os
import subprocess
import sys

from tests.support.waiting import SECONDS

COMPLETE = """
import os, sys
answers, *lines = sys.argv[1:]
os.dup2(int(answers), 8)
os.dup2(2, 9)
from chasles.cli import main
for line in lines:
    if not os.fork():
        os.environ.update(COMP_LINE=line, COMP_POINT=str(len(line)))
        main([])
    _, status = os.wait()
    assert status == 0
    os.write(8, b";")
"""
"""Completes each command line in a forked process, as a shell does in a new process."""


def completed(lines):
    """Returns the sorted words that complete each command line."""
    asked = {"_ARGCOMPLETE": "1", "_ARGCOMPLETE_IFS": "\n", "COMP_TYPE": "9"}
    read, write = os.pipe()
    subprocess.run(
        [sys.executable, "-c", COMPLETE, str(write), *lines],
        env=os.environ | asked,
        pass_fds=[write],
        check=True,
        timeout=SECONDS,
    )
    os.close(write)
    with os.fdopen(read) as answer:
        texts = answer.read().split(";")[:-1]
    return [sorted(word.strip() for word in text.split("\n")) for text in texts]


def test_shell_completes_commands_options_robots_and_file_names(tmp_path):
    (tmp_path / "measured.csv").touch()
    expected = {
        "chasles ca": ["calibrate"],
        "chasles view --h": ["--help", "--html"],
        "chasles info ur1": ["ur10", "ur10e", "ur16e"],
        "chasles calibrate table.csv --robot pan": ["panda"],
        f"chasles calibrate {tmp_path}/mea": [f"{tmp_path}/measured.csv"],
    }
    assert dict(zip(expected, completed(expected), strict=True)) == expected


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
