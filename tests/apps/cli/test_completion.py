"""Shell completion, and output through a pipe."""

import os
import sys
from contextlib import contextmanager
from multiprocessing import get_context

import pytest

from chasles.cli.app import run as main
from tests.support.command_line import run


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


@contextmanager
def piped(*words, end=sys.exit):
    """Run the command line in a fork of this process.

    Yield the process and its output.
    """
    read, write = os.pipe()

    def run_forked():
        sys.stdout = os.fdopen(write, "w")
        end(main(words))

    process = get_context("fork").Process(target=run_forked)
    process.start()
    os.close(write)
    with os.fdopen(read) as output:
        yield process, output
    process.kill()
    process.join()


def test_derive_progress_is_flushed_to_pipe_immediately(tmp_path):
    with piped("derive", "four_bar", "scara", "--to", str(tmp_path)) as (process, output):
        assert output.readline() == "deriving 2 robots\n"
        assert process.is_alive()


def test_runtime_output_is_flushed_line_by_line():
    """The process ends without flushing its output."""
    with piped("list", "--json", end=os._exit) as (_, output):
        assert "ur5e" in output.read()
