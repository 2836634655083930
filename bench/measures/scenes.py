"""``python -m bench scenes``: paths of robots with loops in random scenes, checked ten times finer.

Each scene has balls that almost touch the robot in random postures, so that paths pass close by. A
path that was returned is sampled at ten times as many places as its planner asked, and each of them
is checked for itself.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, fields

import numpy as np
from numpy.typing import NDArray
from rich.table import Table

import chasles
from chasles.study.planning import RobotSpace, ball, roadmap, robot_space

from ..report import out

FloatArray = NDArray[np.float64]
ROBOTS = ("excavator", "well_manipulator", "five_bar", "board_installer", "bricklaying_gantry")
BALLS, DRAWN = 5, 60
SAMPLES, NEIGHBOURS = 30, 6
FINER = 10


@dataclass(frozen=True)
class Scene:
    """What came of a scene: whether a path was found, the places checked, and those that touch."""

    robot: str
    found: bool
    asked: int
    checked: int
    touching: int


@dataclass(frozen=True, eq=False)
class _Recording(RobotSpace):
    """A space that records the postures that are asked."""

    asked: list[FloatArray] = field(default_factory=list)

    def distances(self, q: FloatArray) -> FloatArray:
        """As in `RobotSpace`."""
        self.asked.append(q)
        found: FloatArray = super().distances(q)
        return found


def scenes(count: int, key: int = 1) -> Iterator[Scene]:
    """Random scenes, robot by robot in turn.

    Args:
        count: Number of scenes.
        key: Chooses the random numbers.
    """
    rng = np.random.default_rng(key)
    for k in range(count):
        robot = chasles.load(ROBOTS[k % len(ROBOTS)])
        space, q = drawn(robot, rng)
        start, goal = q
        space.asked.clear()
        plan = roadmap(space, SAMPLES, neighbours=NEIGHBOURS, key=k + 1).plan(start, goal)
        asked = len(space.asked)
        if not plan.found:
            yield Scene(robot.name, False, asked, 0, 0)
            continue
        places = plan.at(np.linspace(0, 1, FINER * max(asked, 100)))
        touching = int((~space.free(places)).sum())
        yield Scene(robot.name, True, asked, len(places), touching)


def drawn(robot: chasles.Robot, rng: np.random.Generator) -> tuple[_Recording, FloatArray]:
    """A space with balls close to the links of random postures, and two free postures (2, n)."""
    while True:
        size = _size(robot)
        radius = 0.02 * size
        empty = robot_space(robot, [ball([0, 0, 1e3 * size], size)], radius=radius)
        q = rng.uniform(empty.lower, empty.upper, (DRAWN, robot.n))
        q = q[np.isfinite(robot.link_poses(q)).all((1, 2, 3))]
        if len(q) < BALLS + 2:
            continue
        balls = []
        for near in q[:BALLS]:
            places = np.vstack([robot.link_poses(near)[:, :3, 3], robot.fk(near)[None, :3, 3]])
            away = rng.normal(size=3)
            own = rng.uniform(0.02, 0.1) * size
            gap = own + radius + rng.uniform(0.0, 0.05) * size
            centre = places[rng.integers(1, len(places))] + gap * away / np.linalg.norm(away)
            balls.append(ball(centre, own))
        made = robot_space(robot, balls, radius=radius)
        space = _Recording(*(getattr(made, own.name) for own in fields(made)))
        free = q[BALLS:][space.free(q[BALLS:])]
        if len(free) > 1:
            return space, free[:2]


def _size(robot: chasles.Robot) -> float:
    """The size of the robot [m]: the spread of its tool."""
    q = np.random.default_rng(0).uniform(robot.lower, robot.upper, (500, robot.n))
    p = robot.fk(q)[:, :3, 3]
    return float(np.linalg.norm(np.nanstd(p, axis=0)) * 2)


def run(count: int) -> int:
    """Prints a table; returns 1 where a path touches something."""
    results = list(scenes(count))
    table = Table(
        title=f"Paths of robots with loops in {count} scenes, checked {FINER} times finer"
    )
    for name in ("robot", "scenes", "paths found", "places checked", "touching"):
        table.add_column(name, justify="left" if name == "robot" else "right")
    for name in ROBOTS:
        own = [scene for scene in results if scene.robot == name]
        found = sum(scene.found for scene in own)
        checked, touching = (sum(s.checked for s in own), sum(s.touching for s in own))
        table.add_row(name, f"{len(own)}", f"{found}", f"{checked:,}", f"{touching}")
    out.print(table)
    return int(any(scene.touching for scene in results))
