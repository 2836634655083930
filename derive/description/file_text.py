"""The text of description files, bounded in size, in the encoding that they have."""

from pathlib import Path

from .toml_file import DescriptionError

LONGEST_FILE = 1_000_000
"""Bytes."""


def text_of(path: str | Path) -> str:
    """The text of a description file.

    Raises:
        DescriptionError: The file cannot be read, is too long, or is not UTF-8.
    """
    return decoded(str(path), read_bytes(path), "utf-8-sig")


def read_bytes(path: str | Path) -> bytes:
    """The content of a description file.

    Raises:
        DescriptionError: The file cannot be read, or is too long.
    """
    file = str(path)
    try:
        with Path(path).open("rb") as stream:
            content = stream.read(LONGEST_FILE + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise DescriptionError(file, None, "", None, f"a readable file ({reason})") from error
    if len(content) > LONGEST_FILE:
        raise DescriptionError(file, None, "", None, f"at most {LONGEST_FILE} bytes")
    return content


def decoded(file: str, content: bytes, encoding: str) -> str:
    """The content of a file as text.

    Args:
        file: Name of the file in errors.
        content: Its bytes.
        encoding: Name of the encoding.

    Raises:
        DescriptionError: The content is not in this encoding, or there is no such encoding.
    """
    name = encoding.upper().removesuffix("-SIG")
    try:
        return content.decode(encoding)
    except UnicodeDecodeError as error:
        line = content[: error.start].count(b"\n") + 1
        raise DescriptionError(file, line, "", None, f"{name} text") from error
    except LookupError as error:
        raise DescriptionError(file, 1, "encoding", encoding, "a known encoding") from error
