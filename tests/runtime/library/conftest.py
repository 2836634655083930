"""Derives robots on first use without a separate compiler process."""

import io
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout

import pytest

from chasles.derive import cli
from chasles.library import derived as described


@pytest.fixture(scope="session")
def compiler_in_process():
    """Replaces `subprocess.run` and runs the compiler in the test process.

    The test process has imported SymPy already. Other programs run as usual.
    """
    run = subprocess.run

    def run_here(command, **options):
        if described._COMPILER not in command:
            return run(command, **options)
        arguments = command[command.index(described._COMPILER) + 1 :]
        code, out, err = 0, io.StringIO(), io.StringIO()
        with pytest.MonkeyPatch.context() as patch, redirect_stdout(out), redirect_stderr(err):
            patch.setattr(sys, "argv", ["chasles-derive", *arguments])
            try:
                cli.main()
            except SystemExit as end:
                code = end.code
        return subprocess.CompletedProcess(command, code, out.getvalue(), err.getvalue())

    return run_here
