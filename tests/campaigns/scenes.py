"""Planned paths of robots with loops, checked at a finer resolution than the planner uses.

Spheres almost touch the robot in random configurations, so the planned paths pass close to the
spheres. Each path is sampled at ten times as many configurations as the planner tested. At each
sampled configuration of a path, the robot must not collide and its loops must be closed. Newton's
method follows the path from sample to sample and keeps the assembly mode. The joint values of each
sample must equal the joint values from Newton's method.
"""

from dataclasses import dataclass, field, fields

import numpy as np
from numpy.typing import NDArray

import chasles
from chasles.drawing import skeleton
from chasles.study.planning import ConfigurationSpace, configuration_space, prm, shortcut, sphere

from .campaign import Campaign, Outcome

FloatArray = NDArray[np.float64]
ROBOTS = (
    *("excavator", "well_manipulator", "five_bar", "board_installer", "bricklaying_gantry"),
    *("planar_3rrr", "stewart_gough", "delta", "four_bar", "slider_crank"),
)
SCENES = 5
"""Number of scenes per trial."""
BALLS, DRAWN, ENOUGH = 5, 200, 40
SAMPLES, NEIGHBOURS, TRIES = 30, 6, 10
FINER = 10
CLOSED = 1e-11
"""Maximum closure error relative to the robot size."""
STEPS = 4
"""Number of Newton steps from one configuration to the next configuration."""
FOLLOWED = 1e-6
"""Joint difference [rad or m] above which two configurations belong to different assembly modes."""


@dataclass(frozen=True)
class Scene:
    """The result of path planning in one random scene.

    Attributes:
        found: Whether a path was found.
        checked: Number of checked configurations on the path.
        touching: Number of configurations in collision.
        open: Number of configurations with an open loop.
        changed: Number of configurations in a wrong assembly mode.
    """

    found: bool
    checked: int = 0
    touching: int = 0
    open: int = 0
    changed: int = 0


@dataclass(frozen=True, eq=False)
class _Recording(ConfigurationSpace):
    """A planning space that records the tested configurations."""

    tested: list[FloatArray] = field(default_factory=list)

    def distances(self, q: FloatArray) -> FloatArray:
        self.tested.append(q)
        found: FloatArray = super().distances(q)
        return found


def trial(number: int) -> Outcome:
    robot = chasles.load(ROBOTS[number % len(ROBOTS)])
    keys = np.random.default_rng(number).integers(2**31, size=SCENES).tolist()
    found = [planned(robot, key) for key in keys]
    failures = [
        f"{robot.name}, key {key}: {s.touching} touch, {s.open} open, {s.changed} in another mode"
        for key, s in zip(keys, found, strict=True)
        if s.touching or s.open or s.changed
    ]
    counts = {
        "scenes": SCENES,
        "paths": sum(s.found for s in found),
        "configurations": sum(s.checked for s in found),
    }
    return Outcome(counts, tuple(failures))


def planned(robot: chasles.Robot, key: int) -> Scene:
    """Plan a path in a random scene and check the path."""
    space, (start, goal) = drawn(robot, np.random.default_rng(key))
    space.tested.clear()
    plan = prm(space, SAMPLES, neighbors=NEIGHBOURS, rng=key).plan(start, goal)
    plan = shortcut(space, plan, attempts=TRIES, rng=key)
    if not plan.found:
        return Scene(False)
    q = plan.at(np.linspace(0, 1, FINER * max(len(space.tested), 100)))
    return Scene(True, len(q), int((~space.is_free(q)).sum()), *left(space, q))


def left(space: ConfigurationSpace, places: FloatArray) -> tuple[int, int]:
    """Count configurations (m, n) with open loops and with a wrong assembly mode."""
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
    """Return a scene of random spheres, and two configurations (2, n) without collision."""
    size = skeleton(robot).size
    radius = 0.01 * size
    empty = configuration_space(robot, [sphere([0, 0, 1e3 * size], size)], radius=radius)
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
            center = places[rng.integers(len(places))] + gap * away / np.linalg.norm(away)
            balls.append(sphere(center, own))
        made = configuration_space(robot, balls, radius=radius)
        space = _Recording(*(getattr(made, own.name) for own in fields(made)))
        free = q[BALLS:][space.is_free(q[BALLS:])]
        if len(free) > 1:
            return space, free[:2]


CAMPAIGN = Campaign(
    "scenes",
    "A path among obstacles touches nothing, keeps loops closed and keeps the assembly mode.",
    trial,
)
