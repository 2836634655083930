"""Shell completion, and output through a pipe."""

import os
import subprocess
import sys
from multiprocessing import get_context

import pytest

from chasles.cli.app import run as main
from tests.support.command_line import run
from tests.support.waiting import SECONDS


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("chasles ca", ["cache", "calibrate"]),
        ("chasles view --h", ["--help", "--html"]),
        ("chasles info ur1", ["ur10", "ur10e", "ur16e"]),
        ("chasles calibrate table.csv --robot pan", ["panda"]),
        ("chasles derive pan", ["panda"]),
        ("chasles new d", ["dh"]),
    ],
    ids=["verb", "option", "robot", "robot option", "robots", "choice"],
)
def test_shell_completes_verbs_options_robots_and_choices(line, words, monkeypatch):
    monkeypatch.setenv("_CHASLES_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", line)
    monkeypatch.setenv("COMP_CWORD", str(len(line.split()) - 1))
    assert sorted(run().stdout.split()) == words


def test_derive_progress_is_flushed_to_pipe_immediately(tmp_path):
    read, write = os.pipe()

    def derive_two():
        sys.stdout = os.fdopen(write, "w")
        main(["derive", "four_bar", "scara", "--to", str(tmp_path)])

    process = get_context("fork").Process(target=derive_two)
    process.start()
    os.close(write)
    with os.fdopen(read) as output:
        assert output.readline() == "deriving 2 robots\n"
        assert process.is_alive()
        process.kill()
        process.join()


def test_runtime_output_is_flushed_line_by_line():
    code = "import chasles.cli.app as m, os; m.run(['list']); os._exit(0)"
    found = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=SECONDS
    )
    assert "ur5e" in found.stdout
