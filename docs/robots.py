"""Writes docs/robots.md: the robots that can be loaded by name, and the inverse of each arm."""

from pathlib import Path

from chasles.derive import SerialRobot, explain, read
from chasles.derive.model.mechanism import Described

PAGE = Path(__file__).with_suffix(".md")
ROBOTS = Path(__file__).parent.parent / "derive" / "robots"
TEXT = """\
# Robots that can be loaded by name

`python docs/robots.py` writes this page. The tables of arms name the structure of the axes that the
inverse uses. If joints are fixed, the number of solutions holds for one value
of the fixed joints. If the axes have a structure only approximately, chasles solves a nominal arm
and [refines its solutions](how-to/calibrated-arms.md). Robots without an inverse have `ik_numeric`.

## The shelf

The shelf is a collection of well-known arms. On first use, `chasles.load("ur10e")` derives the code
of the arm in seconds, and stores the code in the cache. The package `chasles-robots` contains the
compiled code of these arms, for machines without a C compiler. Each file in `derive/robots/shelf`
names the source of its numbers.

{shelf}

## Shipped arms

{arms}

## Shipped robots with loops

[Robots with loops](how-to/loops.md) and [platforms](how-to/platforms.md) describe the functions
of these robots.

{mechanisms}

`make gallery` writes a [page with sliders](how-to/view.md#the-page) of every shipped robot.

`chasles list` prints all robots.
"""


def page() -> str:
    """Return the text of the page."""
    shelf, shipped = _robots(ROBOTS / "shelf"), _robots(ROBOTS)
    return TEXT.format(shelf=_arms(shelf), arms=_arms(shipped), mechanisms=_mechanisms(shipped))


def _robots(folder: Path) -> list[Described]:
    return [read(file) for file in sorted(folder.glob("*.toml"))]


def _arms(robots: list[Described]) -> str:
    rows = [_row(robot) for robot in robots if isinstance(robot, SerialRobot)]
    return "\n".join(["| name | arm | inverse |", "|---|---|---|", *rows])


def _mechanisms(robots: list[Described]) -> str:
    rows = [
        f"| `{robot.name}` | {robot.title}. | {_coordinates(robot)} |"
        for robot in robots
        if not isinstance(robot, SerialRobot)
    ]
    return "\n".join(["| name | robot | coordinates `q` |", "|---|---|---|", *rows])


def _coordinates(robot: Described) -> str:
    return ", ".join(f"`{coordinate.name}`" for coordinate in robot.coordinates)


def _row(robot: SerialRobot) -> str:
    explanation = explain(robot)
    axes = len(robot.coordinates)
    structure = explanation.line.removeprefix("inverse: ").split(", at most ")[0]
    most = explanation.max_solutions
    inverse = f"Inverse: {structure}, up to {most} solutions." if most else "No closed form."
    arm = robot.title if "axes" in robot.title else f"{robot.title} ({axes} axes)"
    cells = (f"`{robot.name}`", f"{arm}.", inverse)
    return f"| {' | '.join(map(str, cells))} |"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
