"""Temporary folders for unfinished files. Folders of killed processes are removed."""

import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

if sys.platform != "win32":
    import fcntl

TEMPORARY = ".chasles-"
"""Prefix of temporary folder names."""
_SUFFIX = "[0-9a-f]" * 16
"""Pattern of the 16 random hexadecimal digits at the end of temporary folder names.

The pattern excludes folders that users created.
"""
_ABANDONED = 86400.0
"""Age [s] after which a temporary folder is removed if the file system has no locks."""


@contextmanager
def temporary_folder(parent: Path, name: str = "") -> Iterator[Path]:
    """Yield a temporary folder, which is removed at the end of the ``with`` block.

    The function first removes folders that ended processes left in the same parent folder. Each
    process locks its folders. The system releases the locks of a killed process.

    Args:
        parent: The folder that contains the temporary folder.
        name: A part of the folder name, such as the name of a robot.
    """
    # The import is local, because loading a compiled robot needs no temporary folder.
    import shutil  # noqa: PLC0415

    remove_abandoned_folders(parent)
    folder, lock = _make(parent, f"{TEMPORARY}{name}{'-' if name else ''}")
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        _unlock(lock)


def remove_abandoned_folders(parent: Path) -> None:
    """Remove temporary folders of killed processes from a folder."""
    for left in parent.glob(f"{TEMPORARY}*{_SUFFIX}"):
        with suppress(OSError):
            _remove_unless_in_use(left)


def _make(parent: Path, prefix: str) -> tuple[Path, int | None]:
    while True:
        folder = parent / f"{prefix}{os.urandom(8).hex()}"
        folder.mkdir(mode=0o700)
        # Another process may remove the folder until this process locks the folder.
        with suppress(BlockingIOError, FileNotFoundError):
            lock = _lock(folder)
            if folder.exists():
                return folder, lock
            _unlock(lock)


def _remove_unless_in_use(folder: Path) -> None:
    import shutil  # noqa: PLC0415

    try:
        lock = _lock(folder)
    except BlockingIOError:
        return
    try:
        if lock is not None or time.time() - folder.stat().st_mtime > _ABANDONED:
            shutil.rmtree(folder)
    finally:
        _unlock(lock)


def _lock(folder: Path) -> int | None:
    """Return an open and locked folder, or None if locks are not supported.

    Raises:
        BlockingIOError: Another process holds the lock.
    """
    if sys.platform == "win32":
        return None
    opened = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        fcntl.flock(opened, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(opened)
        raise
    except OSError:
        os.close(opened)
        return None
    return opened


def _unlock(opened: int | None) -> None:
    if opened is not None:
        os.close(opened)
