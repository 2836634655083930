"""Commented robot files to start from."""

from pathlib import Path

from ...model.errors import InputValueError

_FOLDER = Path(__file__).parent


def template(kind: str) -> str:
    """Returns the text of a commented robot file that is ready to derive.

    Args:
        kind: "arm" (joints with origins and axes), "dh" (a table of joints) or "mechanism" (a boom
            that a cylinder moves).

    Raises:
        InputValueError: The kind is unknown.
    """
    known = sorted(file.stem for file in _FOLDER.glob("*.toml"))
    if kind not in known:
        raise InputValueError(f"template: expected one of {', '.join(known)}, got {kind!r}")
    return (_FOLDER / f"{kind}.toml").read_text(encoding="utf-8")
