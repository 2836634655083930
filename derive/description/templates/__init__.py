"""Commented robot files from which a user can start."""

from pathlib import Path

from ...model.errors import InputValueError

_FOLDER = Path(__file__).parent


def template(kind: str) -> str:
    """Return the text of a robot file with comments.

    The text is a valid robot description that can be derived without changes.

    Args:
        kind: The kind "arm" has joints with origins and axes. The kind "dh" has a table of joints.
            The kind "mechanism" has a boom with a cylinder.

    Raises:
        InputValueError: The kind of the file is unknown.
    """
    known = sorted(file.stem for file in _FOLDER.glob("*.toml"))
    if kind not in known:
        raise InputValueError(f"template: expected one of {', '.join(known)}, got {kind!r}")
    return (_FOLDER / f"{kind}.toml").read_text(encoding="utf-8")
