"""Derives robots on first use without a separate compiler process."""

import io
import subprocess
from contextlib import redirect_stderr, redirect_stdout

import pytest

from chasles.cli import app


@pytest.fixture(scope="session")
def compiler_in_process():
    """Runs the compiler of chasles in the test process, which has already imported SymPy.

    Programs other than the compiler of chasles run in separate processes, as usual.
    """
    run = subprocess.run

    def run_here(command, **options):
        if "derive" not in command:
            return run(command, **options)
        out, err = io.StringIO(), io.StringIO()
        with redirect_stdout(out), redirect_stderr(err):
            code = app.run(command[command.index("derive") :])
        return subprocess.CompletedProcess(command, code, out.getvalue(), err.getvalue())

    return run_here
