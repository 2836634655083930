"""Reads the text of description files, with a size limit and a declared encoding."""

from pathlib import Path

from .toml_file import file_error

LONGEST_FILE = 1_000_000
"""Maximum file size in bytes."""


def text_of(path: str | Path) -> str:
    """Returns the text of a description file.

    Raises:
        DescriptionError: The file cannot be read, is too long, or is not UTF-8.
    """
    return decoded(str(path), read_bytes(path), "utf-8-sig")


def read_bytes(path: str | Path) -> bytes:
    """Returns the content of a description file in bytes.

    Raises:
        DescriptionError: The file cannot be read, or is too long.
    """
    file = str(path)
    try:
        with Path(path).open("rb") as stream:
            content = stream.read(LONGEST_FILE + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise file_error(file, None, "", None, f"a readable file ({reason})") from error
    if len(content) > LONGEST_FILE:
        raise file_error(file, None, "", None, f"at most {LONGEST_FILE} bytes")
    return content


def decoded(file: str, content: bytes, encoding: str) -> str:
    """Decodes the content of a file.

    Args:
        file: Name of the file in error messages.
        content: The bytes of the file.
        encoding: Name of the encoding.

    Raises:
        DescriptionError: The content is not in this encoding, or the encoding is unknown.
    """
    name = encoding.upper().removesuffix("-SIG")
    try:
        return content.decode(encoding)
    except UnicodeDecodeError as error:
        line = content[: error.start].count(b"\n") + 1
        raise file_error(file, line, "", None, f"{name} text") from error
    except LookupError as error:
        raise file_error(file, 1, "encoding", encoding, "a known encoding") from error
    except UnicodeError as error:
        # Codecs such as punycode and idna state no position.
        raise file_error(file, None, "", None, f"{name} text") from error
