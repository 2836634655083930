"""Writes output files completely or not at all."""

import errno
import os
import secrets
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from .errors import InputValueError

_PREFIX = ".chasles-"
_ABANDONED = 3600.0
"""Age [s] of a temporary file whose process was killed."""


def make_folder(path: Path) -> None:
    """Makes a folder and its parents unless they exist.

    Raises:
        InputValueError: The folder cannot be made.
    """
    _check_name(path)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        reason = "it is a file" if isinstance(error, FileExistsError) else error.strerror
        raise InputValueError(f"{path}: cannot be made ({reason})") from error


@contextmanager
def output_file(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yields a temporary file with the suffix of a path; at the end, the file moves to the path.

    After an error, the path has its former content. A device or a pipe is written directly.

    Args:
        path: The file to write.

    Raises:
        InputValueError: The file cannot be written.
    """
    _check_name(path)
    name = os.fspath(path)
    try:
        target = Path(path).resolve()
        if target.is_dir():
            raise OSError(errno.EISDIR, "it is a folder")
        if target.exists() and not os.access(target, os.W_OK):
            raise OSError(errno.EACCES, "it is write-protected")
        if target.exists() and not target.is_file():
            yield target
        else:
            with _replacing(target) as temporary:
                yield temporary
    except OSError as error:
        reason = error.strerror or error
        raise InputValueError(f"{name}: cannot be written ({reason})") from error


def _check_name(path: str | os.PathLike[str]) -> None:
    if "\0" in os.fspath(path):
        raise InputValueError(f"{os.fspath(path)!r}: expected a path without a null character")


@contextmanager
def _replacing(target: Path) -> Iterator[Path]:
    if not target.parent.is_dir():
        raise OSError(errno.ENOENT, f"no folder {target.parent}")
    remove_abandoned(target.parent, f"{_PREFIX}*", _ABANDONED)
    temporary = target.with_name(f"{_PREFIX}{secrets.token_hex(8)}{target.suffix}")
    try:
        yield temporary
        if target.exists():
            temporary.chmod(target.stat().st_mode & 0o777)
        temporary.replace(target)
    finally:
        # After the move, this name no longer exists.
        with suppress(OSError):
            temporary.unlink()


def remove_abandoned(folder: Path, pattern: str, age: float) -> None:
    """Removes temporary files and folders that killed processes left.

    Args:
        folder: The folder with the temporary files.
        pattern: Pattern of their names.
        age: Age [s] after which no process writes them any more.
    """
    for path in folder.glob(pattern):
        with suppress(OSError):
            if time.time() - path.stat().st_mtime > age:
                shutil.rmtree(path) if path.is_dir() else path.unlink()
