"""Commented robot files from which a user can start."""

from pathlib import Path

from ...model.errors import InputValueError

_FOLDER = Path(__file__).parent


def template(kind: str) -> str:
    """Return the text of a commented robot file to start from.

    The text is a valid robot file without changes.

    Args:
        kind: Name of the example robot: "arm" (a serial arm whose joints have origins and axes),
            "dh" (a serial arm in Denavit-Hartenberg parameters) or "mechanism" (a boom with a
            cylinder).

    Raises:
        InputValueError: The kind is unknown.
    """
    known = sorted(file.stem for file in _FOLDER.glob("*.toml"))
    if kind not in known:
        raise InputValueError(f"template: expected one of {', '.join(known)}, got {kind!r}")
    return (_FOLDER / f"{kind}.toml").read_text(encoding="utf-8")
