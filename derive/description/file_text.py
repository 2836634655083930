"""Reads the text of description files. The size of a file is limited."""

import errno
from collections.abc import Iterable
from pathlib import Path

from chasles.contract.input_files import (
    MAX_DESCRIPTION,
    PACKAGE_FILE,
    input_folder,
    is_inside,
    read_input,
)

from ..model.errors import DescriptionError
from .toml_file import file_error


def text_of(path: str | Path) -> str:
    """Return the text of a description file.

    Raises:
        DescriptionError: The file cannot be read, is too long, or is not UTF-8.
    """
    return decoded(str(path), read_bytes(path), "utf-8-sig")


def read_bytes(path: str | Path) -> bytes:
    """Return the content of a description file in bytes.

    Raises:
        DescriptionError: The file cannot be read, or is too long.
    """
    file = str(path)
    try:
        return read_input(path, MAX_DESCRIPTION)
    except OSError as error:
        if error.errno == errno.EFBIG:
            raise _too_long(file) from None
        raise file_error(file, None, "", None, f"a readable file ({error.strerror})") from None


def check_length(file: str, text: str) -> None:
    """Raise an error if a text is too long.

    Raises:
        DescriptionError: The text is longer than the limit.
    """
    if len(text) > MAX_DESCRIPTION:
        raise _too_long(file)


def _too_long(file: str) -> DescriptionError:
    return file_error(file, None, "", None, f"at most {MAX_DESCRIPTION} bytes")


def included_bytes(path: Path, folders: Iterable[Path], by: Path) -> bytes:
    """Return the content of an included file.

    Args:
        path: The included file.
        folders: The folders in which included files may be.
        by: The description.

    Raises:
        FileNotFoundError: The file does not exist.
        DescriptionError: The file is not in one of the folders, cannot be read, or is too long.
    """
    if not any(is_inside(path, folder) for folder in folders):
        expected = (
            f"included files inside {input_folder(by)}; copy the file there, or put a "
            f"{PACKAGE_FILE} into a folder that contains both"
        )
        raise file_error(str(by), None, "", str(path), expected)
    try:
        return read_input(path, MAX_DESCRIPTION)
    except FileNotFoundError:
        raise
    except OSError as error:
        expected = f"readable included files ({error.strerror})"
        raise file_error(str(by), None, "", str(path), expected) from None


def decoded(file: str, content: bytes, encoding: str) -> str:
    """Decode the content of a file.

    Args:
        file: Name of the file in error messages.
        content: The bytes of the file.
        encoding: Name of the text encoding, for example ``utf-8``.

    Raises:
        DescriptionError: The content does not have the stated encoding, or the encoding is unknown.
    """
    name = encoding.upper().removesuffix("-SIG")
    try:
        return content.decode(encoding)
    except UnicodeDecodeError as error:
        line = content[: error.start].count(b"\n") + 1
        raise file_error(file, line, "", None, f"{name} text") from None
    except LookupError:
        raise file_error(file, 1, "encoding", encoding, "a known encoding") from None
    except UnicodeError:
        # Errors of codecs such as punycode and idna contain no position.
        raise file_error(file, None, "", None, f"{name} text") from None
