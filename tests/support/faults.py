"""Lets the n-th file operation of a function call fail, as on a full disk."""

import errno
import os
import resource
import shutil
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

import chasles

EVENTS = ("open", "os.rename", "os.mkdir", "os.link", "os.symlink")
"""Audit events of operations that create or move files. For os.replace, Python reports the event
os.rename."""


class _Watch:
    """Counts the file operations in a folder.

    File operation number `step` raises an error, or ends the process if `is_fatal` is true.
    """

    def __init__(self) -> None:
        self.folder: str | None = None
        self.step: int | None = None
        self.is_fatal = False
        self.seen: list[str] = []

    def __call__(self, event: str, arguments: tuple[object, ...]) -> None:
        if self.folder is None or event not in EVENTS:
            return
        path = arguments[0]
        if not isinstance(path, str | os.PathLike) or not _writes(event, arguments):
            return
        if not os.path.abspath(path).startswith(self.folder):
            return
        self.seen.append(f"{event} {path}")
        if len(self.seen) - 1 == self.step:
            if self.is_fatal:
                os.kill(os.getpid(), signal.SIGKILL)
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), os.fspath(path))


def _writes(event: str, arguments: tuple[object, ...]) -> bool:
    if event == "os.mkdir":
        # If the folder exists, Python ignores the error of `os.mkdir`.
        return not os.path.isdir(str(arguments[0]))
    flags = arguments[2] if event == "open" else os.O_WRONLY
    return isinstance(flags, int) and bool(flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT))


_WATCH = _Watch()
_INSTALLED: list[bool] = []


@contextmanager
def _watching(folder: Path, step: int | None) -> Iterator[list[str]]:
    if not _INSTALLED:
        # Audit hooks cannot be removed, so a single audit hook stays installed.
        sys.addaudithook(_WATCH)
        _INSTALLED.append(True)
    _WATCH.folder, _WATCH.step, _WATCH.seen = str(folder.resolve()), step, []
    try:
        yield _WATCH.seen
    finally:
        _WATCH.folder = None


def steps_of(work: Callable[[], object], folder: Path) -> list[str]:
    """Return the file operations that a call performs in a folder."""
    with _watching(folder, None) as seen:
        work()
    return seen


@contextmanager
def failing(step: int, folder: Path) -> Iterator[None]:
    """Make one file operation in a folder fail, as if the disk were full."""
    with _watching(folder, step) as seen:
        yield
    assert len(seen) > step, f"only {len(seen)} file operations"


def killed(step: int, work: Callable[[], object], folder: Path) -> None:
    """Run the function ``work`` in a forked process.

    SIGKILL ends the forked process just before file operation number `step` in the folder.
    """
    child = os.fork()
    if child == 0:
        _WATCH.is_fatal = True
        try:
            with failing(step, folder):
                work()
        finally:
            os._exit(1)
    _, status = os.waitpid(child, 0)
    assert os.WIFSIGNALED(status), f"ended before file operation {step}"


@contextmanager
def full_after(size: int) -> Iterator[None]:
    """Context in which writing a file beyond ``size`` bytes fails."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def contents(folder: Path) -> dict[str, bytes | None]:
    """Map each path in a folder to its bytes, or to None for a subfolder."""
    return {
        path.relative_to(folder).as_posix(): None if path.is_dir() else path.read_bytes()
        for path in sorted(folder.rglob("*"))
    }


def restore(folder: Path, former: dict[str, bytes | None]) -> None:
    """Restore the former contents of a folder."""
    shutil.rmtree(folder)
    folder.mkdir()
    for name, content in former.items():
        if content is None:
            (folder / name).mkdir()
        else:
            (folder / name).write_bytes(content)


def check_writes(write: Callable[[], object], folder: Path, match: str | None = None) -> None:
    """Check that files survive each fault, and that a second write succeeds.

    In each run, a different file operation of ``write`` fails. In two further runs, the disk is
    full from the start, or becomes full before the end. After an error, each file must have either
    its former or its new content.

    Args:
        write: Function that writes several files into ``folder``.
        folder: The output folder, which contains the files of an earlier run.
        match: Regular expression that the error message must match, or None for any message.
    """
    former = contents(folder)
    steps = steps_of(write, folder)
    written = contents(folder)
    assert steps
    assert written != former
    size = max(len(content or b"") for content in written.values())
    first_move = next(k for k, step in enumerate(steps) if step.startswith("os.rename"))
    restore(folder, former)
    for step, operation in enumerate(steps):
        with pytest.raises(chasles.ChaslesError, match=match), failing(step, folder):
            write()
        left = contents(folder)
        if step <= first_move:
            assert left == former, operation
        assert all(left[name] in (former.get(name), written[name]) for name in left), operation
        restore(folder, former)
    for limit in (0, size - 1):
        with pytest.raises(chasles.ChaslesError, match=match), full_after(limit):
            write()
        assert contents(folder) == former, f"full after {limit} bytes"
    write()
    assert contents(folder).keys() == written.keys()
