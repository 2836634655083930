"""Runs the command line of chasles in the test process."""

import contextlib
import io
from dataclasses import dataclass
from unittest.mock import patch

from chasles.cli.app import run as run_command

WIDTH = "200"
"""Number of columns of the terminal, large enough that messages are not wrapped."""


@dataclass(frozen=True)
class Done:
    exit_code: int
    stdout: str
    stderr: str

    @property
    def output(self) -> str:
        return self.stdout + self.stderr


def run(*words: object) -> Done:
    """Run ``chasles`` with the given command-line arguments."""
    out, err = io.StringIO(), io.StringIO()
    environment = patch.dict("os.environ", {"COLUMNS": WIDTH, "TERM": "dumb", "NO_COLOR": "1"})
    with environment, contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        status = run_command([str(word) for word in words])
    return Done(status, out.getvalue(), err.getvalue())
