"""``python -m bench scenes``: paths of robots with loops in random scenes, checked ten times finer.

Each scene has balls that almost touch the robot in random postures, so that paths pass close by. A
path that was returned, and shortened, is sampled at ten times as many places as its planner asked,
and each of them is checked for itself: nothing touches, the loops are closed, and the joints are
those that Newton's iteration follows from the start, so that no assembly mode changed.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, fields

import numpy as np
from numpy.typing import NDArray
from rich.table import Table

import chasles
from chasles.drawing import skeleton
from chasles.study.planning import RobotSpace, ball, roadmap, robot_space, shortened

from ..report import out

FloatArray = NDArray[np.float64]
ROBOTS = (
    *("excavator", "well_manipulator", "five_bar", "board_installer", "bricklaying_gantry"),
    *("planar_3rrr", "stewart_gough", "delta", "four_bar", "slider_crank"),
)
BALLS, DRAWN, ENOUGH = 5, 200, 40
SAMPLES, NEIGHBOURS, TRIES = 30, 6, 10
FINER = 10
CLOSED = 1e-11
"""Error of closed loops, in parts of the robot's size, that is rounding."""
STEPS = 4
"""Steps of Newton's iteration from a place to the next, which is near."""
FOLLOWED = 1e-6
"""Difference of joints [rad or m] from which they are on another branch: branches are far apart."""


@dataclass(frozen=True)
class Scene:
    """What came of a scene.

    Attributes:
        robot: Name of the robot.
        found: Whether there is a path.
        asked: Number of postures that the planner asked.
        checked: Number of places on the path that were checked.
        touching: How many of them touch.
        open: At how many of them a loop is open.
        changed: At how many of them the joints are not those that lead there from the start.
    """

    robot: str
    found: bool
    asked: int
    checked: int = 0
    touching: int = 0
    open: int = 0
    changed: int = 0


@dataclass(frozen=True, eq=False)
class _Recording(RobotSpace):
    """A space that records the postures that are asked."""

    asked: list[FloatArray] = field(default_factory=list)

    def distances(self, q: FloatArray) -> FloatArray:
        """As in `RobotSpace`."""
        self.asked.append(q)
        found: FloatArray = super().distances(q)
        return found


def scenes(count: int, key: int = 1, robots: Sequence[str] = ROBOTS) -> Iterator[Scene]:
    """Random scenes, robot by robot in turn.

    Args:
        count: Number of scenes.
        key: Chooses the random numbers.
        robots: Names of robots with loops.
    """
    rng = np.random.default_rng(key)
    for k in range(count):
        robot = chasles.load(robots[k % len(robots)])
        space, (start, goal) = drawn(robot, rng)
        space.asked.clear()
        plan = roadmap(space, SAMPLES, neighbours=NEIGHBOURS, key=k + 1).plan(start, goal)
        plan = shortened(space, plan, tries=TRIES, key=k)
        asked = len(space.asked)
        if not plan.found:
            yield Scene(robot.name, False, asked)
            continue
        places = plan.at(np.linspace(0, 1, FINER * max(asked, 100)))
        touching = int((~space.free(places)).sum())
        yield Scene(robot.name, True, asked, len(places), touching, *left(space, places))


def left(space: RobotSpace, places: FloatArray) -> tuple[int, int]:
    """At how many places of a path (m, n) loops are open, and at how many on another branch."""
    robot, bounds = space.robot, space.bounds
    assert bounds is not None
    z = robot.configuration(places)
    error = np.abs(robot.constraint(z)).max(-1)
    is_open = ~(error <= CLOSED * max(1.0, skeleton(robot).size))
    free = np.setdiff1d(np.arange(z.shape[1]), bounds.given)
    followed, changed = z[0].copy(), 0
    for here in z:
        followed[bounds.given] = here[bounds.given]
        for _ in range(STEPS):
            D = robot.constraint_D_z(followed)[:, free]
            followed[free] -= np.linalg.lstsq(D, robot.constraint(followed), rcond=None)[0]
        away = followed - here
        away[bounds.turns] = (away[bounds.turns] + np.pi) % (2 * np.pi) - np.pi
        changed += not np.abs(away).max() <= FOLLOWED
    return int(is_open.sum()), changed


def drawn(robot: chasles.Robot, rng: np.random.Generator) -> tuple[_Recording, FloatArray]:
    """A space with balls close to the bodies of random postures, and two free postures (2, n)."""
    size = skeleton(robot).size
    radius = 0.01 * size
    empty = robot_space(robot, [ball([0, 0, 1e3 * size], size)], radius=radius)
    while True:
        q = np.empty((0, robot.n))
        while len(q) < ENOUGH:
            more = rng.uniform(empty.lower, empty.upper, (DRAWN, robot.n))
            q = np.vstack([q, more[np.isfinite(robot.configuration(more)).all(-1)]])
        balls = []
        for near in q[:BALLS]:
            places = np.vstack(empty.hulls.corners(robot.configuration(near)))
            away = rng.normal(size=3)
            own = rng.uniform(0.01, 0.05) * size
            gap = own + radius + rng.uniform(0.0, 0.03) * size
            centre = places[rng.integers(len(places))] + gap * away / np.linalg.norm(away)
            balls.append(ball(centre, own))
        made = robot_space(robot, balls, radius=radius)
        space = _Recording(*(getattr(made, own.name) for own in fields(made)))
        free = q[BALLS:][space.free(q[BALLS:])]
        if len(free) > 1:
            return space, free[:2]


def run(count: int) -> int:
    """Prints a table; returns 1 where a path touches something, is open or leaves its mode."""
    results = list(scenes(count))
    table = Table(
        title=f"Paths of robots with loops in {count} scenes, checked {FINER} times finer"
    )
    heads = ("robot", "scenes", "paths found", "places checked", "touching", "open", "other mode")
    for name in heads:
        table.add_column(name, justify="left" if name == "robot" else "right")
    for name in ROBOTS:
        own = [scene for scene in results if scene.robot == name]
        sums = [sum(getattr(scene, what) for scene in own) for what in ("found", "checked")]
        bad = [sum(getattr(s, what) for s in own) for what in ("touching", "open", "changed")]
        table.add_row(name, f"{len(own)}", f"{sums[0]}", f"{sums[1]:,}", *map(str, bad))
    out.print(table)
    return int(any(scene.touching or scene.open or scene.changed for scene in results))
