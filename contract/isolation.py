"""Runs a function in a separate process with time and memory limits."""

import os
import pickle
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from .forking import forked, outcome_of, received

if sys.platform != "win32":
    import resource

Result = TypeVar("Result")
STATUS = Path("/proc/self/statm")
"""A Linux file that begins with the size of the process in memory pages."""


@dataclass(frozen=True)
class Limits:
    """Limits of an isolated process.

    Attributes:
        seconds: Wall-clock time.
        memory: Number of bytes that the child may allocate beyond the memory of this
            process. Ignored on Windows.
    """

    seconds: float = 60.0
    memory: int = 4 << 30


class IsolatedWorkError(RuntimeError):
    """A function in a separate process exceeded a limit, or the process crashed."""


def isolated(work: Callable[[], Result], limits: Limits = Limits()) -> Result:
    """Run a function in a separate process that cannot write files, and return the result.

    On Linux, the separate process is a fork of the calling process. If other threads held a lock at
    the fork, a library in the process may wait for the lock forever. The time limit then ends the
    process. On other systems, a new Python interpreter starts, which takes one second.

    Args:
        work: The function to run. The function must return plain data.
        limits: Limits of the process.

    Raises:
        IsolatedWorkError: ``work`` exceeded a limit, or the process crashed. Exceptions that
            ``work`` raises are raised again unchanged.
    """
    run = _forked if sys.platform == "linux" else _started
    try:
        return run(work, limits)
    except MemoryError:
        text = f"it needs more than {limits.memory / 2**30:g} GiB of memory"
        raise IsolatedWorkError(text) from None


def _forked(work: Callable[[], Result], limits: Limits) -> Result:
    with forked(lambda: _limited(work, limits)) as receiver:
        if not receiver.poll(limits.seconds):
            raise _late(limits)
        try:
            outcome: Result = received(receiver)
        except EOFError:
            raise _crashed() from None
        return outcome


def _started(work: Callable[[], Result], limits: Limits) -> Result:
    code = "from chasles.contract.isolation import main; main()"
    try:
        finished = subprocess.run(
            [sys.executable, "-c", code],
            input=pickle.dumps((work, limits)),
            stdout=subprocess.PIPE,
            timeout=limits.seconds,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise _late(limits) from None
    if finished.returncode:
        raise _crashed()
    is_done, found = pickle.loads(finished.stdout)
    if not is_done:
        raise found
    outcome: Result = found
    return outcome


def main() -> None:
    """Run a pickled function from standard input and write its outcome to standard output."""
    work, limits = pickle.loads(sys.stdin.buffer.read())
    output = os.fdopen(os.dup(1), "wb")
    # Output of libraries must not mix with the result.
    os.dup2(2, 1)
    with output:
        output.write(pickle.dumps(outcome_of(lambda: _limited(work, limits))))


def _limited(work: Callable[[], Result], limits: Limits) -> Result:
    if sys.platform != "win32":
        pages = int(STATUS.read_text().split()[0]) if STATUS.exists() else 0
        _lower(resource.RLIMIT_AS, pages * resource.getpagesize() + limits.memory)
        _lower(resource.RLIMIT_FSIZE, 0)
        _lower(resource.RLIMIT_CORE, 0)
    return work()


def _lower(kind: int, limit: int) -> None:
    """Set a resource limit of this process.

    A lower hard limit is kept.
    """
    _, hard = resource.getrlimit(kind)
    limit = limit if hard == resource.RLIM_INFINITY else min(limit, hard)
    resource.setrlimit(kind, (limit, limit))


def _late(limits: Limits) -> IsolatedWorkError:
    return IsolatedWorkError(f"it takes longer than {limits.seconds:g} s")


def _crashed() -> IsolatedWorkError:
    return IsolatedWorkError("its process has crashed")
