"""Writes output files completely or not at all."""

import errno
import os
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path

from .errors import InputValueError
from .input_files import as_path
from .temporary_folders import temporary_folder


def make_folder(path: Path) -> None:
    """Create a folder and its parent folders unless they exist.

    Raises:
        InputValueError: The folder cannot be created.
    """
    _check_name(path)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        reason = "a file has this path" if isinstance(error, FileExistsError) else error.strerror
        raise InputValueError(f"{path}: the folder cannot be created ({reason})") from None


@contextmanager
def output_file(path: str | os.PathLike[str], *, is_new: bool = False) -> Iterator[Path]:
    """Yield the path of a temporary file. At the end, the file is renamed to the output path.

    After an error, the file at the output path keeps its former content. A device or a pipe is
    written directly.

    Args:
        path: The file to write.
        is_new: If True, an existing file at the path raises an error, even if another process has
            just created the file.

    Raises:
        InputValueError: The file cannot be written.
    """
    _check_name(path)
    name = os.fspath(path)
    try:
        target = Path(path).resolve()
        if is_new and os.path.lexists(path):
            raise OSError(errno.EEXIST, "it exists already")
        if target.is_dir():
            raise OSError(errno.EISDIR, "it is a folder")
        if target.exists() and not os.access(target, os.W_OK):
            raise OSError(errno.EACCES, "it is write-protected")
        if target.exists() and not target.is_file():
            yield target
        else:
            with _replacing(target, is_new) as temporary:
                yield temporary
    except OSError as error:
        reason = error.strerror or error
        raise InputValueError(f"{name}: the file cannot be written ({reason})") from None


def write_files(contents: Mapping[Path, bytes]) -> None:
    """Write several files.

    The last file is moved to its path after all others.

    If a file cannot be written, all paths keep their content.

    Args:
        contents: The content of each file, keyed by path.

    Raises:
        InputValueError: A file cannot be written.
    """
    with ExitStack() as stack:
        # ExitStack closes the files in reverse order.
        for path, content in reversed(list(contents.items())):
            stack.enter_context(output_file(path)).write_bytes(content)


def _check_name(path: str | os.PathLike[str]) -> None:
    if "\0" in os.fspath(as_path("path", path)):
        raise InputValueError(f"{os.fspath(path)!r}: expected a path without a null character")


@contextmanager
def _replacing(target: Path, is_new: bool) -> Iterator[Path]:
    if not target.parent.is_dir():
        raise OSError(errno.ENOENT, f"no folder {target.parent}")
    with temporary_folder(target.parent) as folder:
        temporary = folder / target.name
        yield temporary
        if target.exists():
            temporary.chmod(target.stat().st_mode & 0o777)
        if is_new and os.name == "posix":
            # If another process has already written the target file, os.link raises an error and
            # does not replace the file.
            os.link(temporary, target)
        else:
            temporary.replace(target)
