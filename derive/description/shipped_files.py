"""The robot files that are installed with chasles, by name."""

from pathlib import Path

ROBOTS = Path(__file__).parents[1] / "robots"
SHELF = ROBOTS / "shelf"
"""Well-known arms, derived where they are asked for; their generated folders are not committed."""


def robot_names(folder: Path) -> list[str]:
    """The names of the robots of a folder, in order."""
    return sorted(path.stem for path in folder.glob("*.toml"))


def shipped_file(name: str) -> Path | None:
    """The file of a robot that is installed with chasles; None for other names."""
    for folder in (ROBOTS, SHELF):
        if name in robot_names(folder):
            return folder / f"{name}.toml"
    return None


def nominal_file(file: Path, nominal: str) -> Path:
    """The file of the robot that a robot file names as nominal: a shipped robot, or one beside."""
    return shipped_file(nominal) or file.parent / nominal
