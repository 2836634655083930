"""Search for the folder of a generated robot by name, description or path."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from ..contract import UnknownRobotError, as_path
from ..errors import InputValueError
from .derived import (
    PARAMETRIC,
    SUFFIXES,
    derived_folder,
    generated_folders,
    is_description,
    shelf,
    shipped,
)


def shipped_folders() -> dict[str, Path]:
    """Return the folders of the installed generated robots, keyed by name."""
    manifests = [file for root in generated_folders() for file in root.glob("*/manifest.json")]
    return {file.parent.name: file.parent for file in sorted(manifests)}


def find_folder(robot: str | os.PathLike[str], options: Sequence[str] = ()) -> Path:
    """Return the folder of a robot for `chasles.load`, derived if necessary."""
    path = as_path("robot", robot)
    if is_description(path):
        return derived_folder(path, options)
    if path.is_file():
        expected = f"a description ({', '.join(SUFFIXES)}) or the folder of a generated robot"
        raise UnknownRobotError(f"{path}: expected {expected}")
    if not isinstance(robot, str) or {os.sep, os.altsep} & set(robot):
        if set(options) - {PARAMETRIC}:
            raise InputValueError(
                f"{path}: expected a description for {' '.join(options)}, got a folder"
            )
        return path
    folders = shipped_folders()
    if robot in folders and not options:
        return folders[robot]
    arms = (shipped() if options else {}) | shelf()
    if robot in arms:
        return derived_folder(arms[robot], options)
    known = ", ".join(folders) or "none are installed"
    derived = ", ".join(shelf()) or "none; pip install chasles-robots or 'chasles[derive]'"
    raise UnknownRobotError(
        f"no robot named {robot!r}; {_hint(robot, [*folders, *arms])}known: {known}; to load "
        f"a folder, pass its path, './{robot}'; robots derived on first use: {derived}"
    )


def _hint(robot: str, names: list[str]) -> str:
    import difflib  # noqa: PLC0415

    plain = {"".join(filter(str.isalnum, name)): name for name in names}
    meant = "".join(filter(str.isalnum, robot.lower()))
    close = [meant] if meant in plain else difflib.get_close_matches(meant, plain)
    return f"did you mean {' or '.join(plain[name] for name in close)}? " if close else ""
