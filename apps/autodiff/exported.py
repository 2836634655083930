"""Lookup of the source files that `chasles export` wrote for a robot."""

from __future__ import annotations

import json
import os
from pathlib import Path

from chasles import InputValueError, Robot


def exported(robot: Robot, folder: str | os.PathLike[str], ending: str, language: str) -> Path:
    """Return the path of a file that `chasles export` wrote for a robot.

    Args:
        robot: The robot.
        folder: The output folder of `chasles export`.
        ending: The part of the file name after the robot's name.
        language: The language of the export.

    Raises:
        InputValueError: The folder does not contain this file of the robot.
    """
    path = Path(folder) / f"{robot.name}{ending}"
    manifest = path.with_name("manifest.json")
    if path.is_file() and manifest.is_file():
        content = json.loads(manifest.read_text(encoding="utf-8"))
        if content.get("description_sha256") == robot.manifest.description_sha256:
            return path
    raise InputValueError(
        f"folder {path.parent}: no current {language} source of {robot.name}; "
        f"run chasles export {language} {robot.name} --to {path.parent.parent}"
    )
