"""Lets the n-th file operation of a call fail, as on a full disk."""

import errno
import os
import resource
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

EVENTS = ("open", "os.rename", "os.mkdir", "os.link", "os.symlink")
"""Audit events of Python that create or move files; os.replace is an os.rename."""


class _Watch:
    """Counts the events in a folder, and raises an error at one of them."""

    def __init__(self) -> None:
        self.folder: str | None = None
        self.step: int | None = None
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
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), os.fspath(path))


def _writes(event: str, arguments: tuple[object, ...]) -> bool:
    flags = arguments[2] if event == "open" else os.O_WRONLY
    return isinstance(flags, int) and bool(flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT))


_WATCH = _Watch()
_INSTALLED: list[bool] = []


@contextmanager
def _watching(folder: Path, step: int | None) -> Iterator[list[str]]:
    if not _INSTALLED:
        # Audit hooks cannot be removed, so a single hook stays installed.
        sys.addaudithook(_WATCH)
        _INSTALLED.append(True)
    _WATCH.folder, _WATCH.step, _WATCH.seen = str(folder.resolve()), step, []
    try:
        yield _WATCH.seen
    finally:
        _WATCH.folder = None


def steps_of(work: Callable[[], object], folder: Path) -> list[str]:
    """Returns the file operations of a call in a folder."""
    with _watching(folder, None) as seen:
        work()
    return seen


@contextmanager
def failing(step: int, folder: Path) -> Iterator[None]:
    """Lets one file operation in a folder fail: there is no space left on the device."""
    with _watching(folder, step) as seen:
        yield
    assert len(seen) > step, f"only {len(seen)} file operations"


@contextmanager
def full_after(size: int) -> Iterator[None]:
    """Lets each write beyond a file size fail. Python ignores the signal of this limit."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
