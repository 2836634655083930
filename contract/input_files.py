"""Opens regular input files in the folder of a robot, with a size limit."""

import errno
import os
import stat
from pathlib import Path
from typing import Any, BinaryIO

from .errors import InputTypeError

_FLAGS = getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0) | getattr(os, "O_CLOEXEC", 0)
"""Without O_NONBLOCK, the process waits when it opens a named pipe. Windows has O_BINARY."""

MAX_FILE = 1 << 28
"""Maximum size of a table or a generated file in bytes."""
_PART = 1 << 20
"""Number of bytes that are read at once. Python allocates a buffer of this size before reading."""
MAX_DESCRIPTION = 1_000_000
"""Maximum size of a robot description in bytes."""
PACKAGE_FILE = "package.xml"
"""File that marks the folder of a ROS package."""
FOLDERS_UP = 5
"""Number of folders that are searched for a package, from the folder of a file upwards."""


def as_path(name: str, path: Any) -> Path:
    """Return an argument as a path.

    Args:
        name: Name of the argument, for the error.
        path: The argument.

    Raises:
        InputTypeError: The argument is not text and not a path.
    """
    if not isinstance(path, str | os.PathLike) or not isinstance(os.fspath(path), str):
        raise InputTypeError(f"{name}: expected a path, got {path!r}")
    return Path(path)


def input_folder(file: Path) -> Path:
    """Return the folder of the files that a description may include.

    The folder is the ROS package that contains the description. If no ROS package contains the
    description, the folder of the description is returned.
    """
    folders = list(file.resolve().parents)[:FOLDERS_UP]
    return next((own for own in folders if (own / PACKAGE_FILE).is_file()), folders[0])


def is_inside(file: Path, folder: Path) -> bool:
    """Whether a file is in a folder, after symbolic links are resolved."""
    return file.resolve().is_relative_to(folder.resolve())


def open_input(path: str | os.PathLike[str]) -> BinaryIO:
    """Open a file for reading, and reject folders, pipes and devices.

    Raises:
        OSError: The file cannot be opened, or is a folder, a pipe or a device.
    """
    if "\0" in os.fspath(as_path("path", path)):
        reason = "a path must not contain a null character"
        raise OSError(errno.EINVAL, reason, repr(os.fspath(path)))
    handle = os.open(path, os.O_RDONLY | _FLAGS)
    if not stat.S_ISREG(os.fstat(handle).st_mode):
        os.close(handle)
        raise OSError(errno.EINVAL, "not a regular file", os.fspath(path))
    return os.fdopen(handle, "rb")


def read_input(path: str | os.PathLike[str], max_bytes: int = MAX_FILE) -> bytes:
    """Read a regular file.

    Args:
        path: The file.
        max_bytes: Maximum size of the file in bytes.

    Raises:
        OSError: The file cannot be read, is not a regular file, or is too large.
    """
    parts, left = [], max_bytes + 1
    with open_input(path) as stream:
        while part := stream.read(min(left, _PART)):
            parts.append(part)
            left -= len(part)
    if not left:
        raise OSError(errno.EFBIG, f"larger than {max_bytes} bytes", os.fspath(path))
    return b"".join(parts)
