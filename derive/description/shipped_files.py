"""The files of robots: by path, or by the name of a robot that is installed with chasles."""

import os
import re
from difflib import get_close_matches
from pathlib import Path

from ..model.errors import RobotError

ROBOTS = Path(__file__).parents[1] / "robots"
SHELF = ROBOTS / "shelf"
"""Well-known arms, derived where they are asked for; their generated folders are not committed."""
NAMED = "robot:"
"""The prefix of a name of the package robot_descriptions."""


def robot_names(folder: Path) -> list[str]:
    """The names of the robots of a folder, in order."""
    return sorted(path.stem for path in folder.glob("*.toml"))


def shipped_file(name: str) -> Path | None:
    """The file of a robot that is installed with chasles; None for other names."""
    for folder in (ROBOTS, SHELF):
        if name in robot_names(folder):
            return folder / f"{name}.toml"
    return None


def located(source: str | Path) -> tuple[Path, tuple[str, ...]]:
    """The file of a robot, and the arguments of a xacro file.

    Args:
        source: A path; or the name of a robot that is installed with chasles, or ``robot:NAME``
            with a name of the package robot_descriptions.

    Raises:
        RobotError: There is no such robot or file.
    """
    name = str(source)
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
    raise RobotError(f"{name}: expected a robot file, or one of {', '.join(known)}{hint}")


def _nearest(name: str, known: list[str]) -> str:
    """The known name that is meant, by its letters and digits; empty if none is near."""
    plain = {re.sub(r"[^a-z0-9]", "", other): other for other in known}
    close = get_close_matches(re.sub(r"[^a-z0-9]", "", name.lower()), plain, n=1)
    return plain[close[0]] if close else ""


def nominal_file(file: Path, nominal: str) -> Path:
    """The file of the robot that a robot file names as nominal: a shipped robot, or one beside."""
    return shipped_file(nominal) or file.parent / nominal
