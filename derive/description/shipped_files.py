"""Finds robot files by their path or by the name of an installed robot."""

import os
import re
from difflib import get_close_matches
from pathlib import Path

from chasles.contract.input_files import as_path

from ..model.errors import UnknownRobotError

ROBOTS = Path(__file__).parents[1] / "robots"
SHELF = ROBOTS / "shelf"
"""Folder of arms whose generated code is not installed with chasles."""
NAMED = "robot:"
"""Prefix of the names of robots in the package robot_descriptions."""


def robot_names(folder: Path) -> list[str]:
    """Return the sorted names of the robots in a folder."""
    return sorted(path.stem for path in folder.glob("*.toml"))


def shipped_file(name: str) -> Path | None:
    """Return the file of an installed robot, or None if the name is unknown."""
    for folder in (ROBOTS, SHELF):
        if name in robot_names(folder):
            return folder / f"{name}.toml"
    return None


def located(source: str | Path) -> tuple[Path, tuple[str, ...]]:
    """Return the path of a robot file, and the xacro arguments for this file.

    Args:
        source: A path, the name of a robot installed with chasles, or ``robot:NAME`` for a robot in
            the package robot_descriptions.

    Raises:
        UnknownRobotError: The robot or the file does not exist.
    """
    name = str(as_path("source", source))
    shipped = shipped_file(name) if isinstance(source, str) else None
    if shipped is not None:
        return shipped, ()
    if name.startswith(NAMED):
        from .importers.named_robots import described  # noqa: PLC0415

        return described(name.removeprefix(NAMED))
    path = Path(source)
    if path.suffix or os.sep in name or path.is_file():
        return path, ()
    known = [*robot_names(ROBOTS), *robot_names(SHELF)]
    hint = f" (did you mean {near}?)" if (near := _nearest(name, known)) else ""
    raise UnknownRobotError(f"{name}: expected a robot file, or one of {', '.join(known)}{hint}")


def _nearest(name: str, known: list[str]) -> str:
    """Return the most similar known name, or ""."""
    plain = {re.sub(r"[^a-z0-9]", "", other): other for other in known}
    close = get_close_matches(re.sub(r"[^a-z0-9]", "", name.lower()), plain, n=1)
    return plain[close[0]] if close else ""


def nominal_file(file: Path, nominal: str) -> Path:
    """Return the path of a nominal robot: a shipped file, or a file in the folder of ``file``."""
    return shipped_file(nominal) or file.parent / nominal
