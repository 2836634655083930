"""The folder of a generated robot, found by its name, its description or its path."""

from __future__ import annotations

import os
from importlib.util import find_spec
from pathlib import Path

from ..contract import UnknownRobotError
from .derived import PARAMETRIC, derived_folder, is_description, shelf, shipped


def shipped_folders() -> dict[str, Path]:
    """The folders of the generated robots that are installed with chasles, by name."""
    spec = find_spec("chasles.generated")
    roots = spec.submodule_search_locations if spec else None
    manifests = [file for root in roots or () for file in Path(root).glob("*/manifest.json")]
    return {file.parent.name: file.parent for file in sorted(manifests)}


def find_folder(robot: str | os.PathLike[str], *, parametric: bool = False) -> Path:
    """The folder of a robot, found as by `chasles.load`, and derived first if necessary.

    Raises:
        UnknownRobotError: If no installed robot has that name.
        DerivationError: If the compiler is not installed or refuses the description.
    """
    options = PARAMETRIC if parametric else ()
    path = Path(robot)
    if is_description(path):
        return derived_folder(path, options)
    if not isinstance(robot, str) or os.sep in robot or path.is_file():
        return path
    folders = shipped_folders()
    if robot in folders and not parametric:
        return folders[robot]
    arms = (shipped() if parametric else {}) | shelf()
    if robot in arms:
        return derived_folder(arms[robot], options)
    import difflib  # noqa: PLC0415

    close = difflib.get_close_matches(robot, [*folders, *arms])
    hint = f"did you mean {' or '.join(close)}? " if close else ""
    known = ", ".join(folders) or "none are installed"
    raise UnknownRobotError(
        f"no robot named {robot!r}; {hint}known: {known}; a folder is given as a path, './{robot}'"
        f"; derived on first use: {', '.join(arms)}"
    )
