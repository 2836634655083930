"""Random tests of the loop closure of the shipped robots with loops.

The coordinates are drawn from a range that is twice as wide as the joint limits. The joint values
of a configuration must be finite exactly if the robot reports closed loops.
"""

import tomllib
from collections.abc import Iterator
from functools import cache

import numpy as np

import chasles
from chasles.derive import Mechanism, read
from chasles.derive.description.mechanism_file import has_loops
from tests.support.derivations import ROBOTS
from tests.support.oracles.multi_start import Multistart

from .campaign import Campaign, Outcome

BLOCK, BLOCKS = 20_000, 10
WIDER = 2.0
"""Range of the sampled coordinates, as a multiple of the limit range."""
OPEN = 1e-12
"""Maximum closure error relative to the robot size."""


@cache
def with_loops(pattern: str = "*.toml") -> tuple[Mechanism, ...]:
    """Return the shipped robots with loops whose files match a pattern."""
    files = sorted(ROBOTS.glob(pattern))
    tables = {file: tomllib.loads(file.read_text(encoding="utf-8")) for file in files}
    # A robot file with the key `extends` includes the loops of the file that it extends.
    found = (read(file) for file, at in tables.items() if has_loops(at) or "extends" in at)
    return tuple(robot for robot in found if isinstance(robot, Mechanism) and robot.loop_joints)


def trial(number: int) -> Outcome:
    robots = with_loops()
    mechanism = robots[number % len(robots)]
    closed, wrong, largest = judged(mechanism, np.random.default_rng(number))
    counts = {"configurations": BLOCK * BLOCKS, "closed configurations": closed}
    failures = (f"{mechanism.name}: {wrong} wrong, largest gap {largest:.1e}",) if wrong else ()
    return Outcome(counts, failures, {"gap": largest})


def judged(mechanism: Mechanism, rng: np.random.Generator) -> tuple[int, int, float]:
    """Return the numbers of closed and wrong configurations, and the largest closure error."""
    robot, numbers = chasles.load(mechanism.name), Multistart(mechanism)
    is_map = robot.loop_solution == "closed form"
    closed, wrong, largest = 0, 0, 0.0
    for _ in range(BLOCKS):
        values, valid, finite = _configurations(robot, numbers, rng, is_map)
        gaps = numbers.gaps({name: of[finite] for name, of in values.items()})
        closed += int(valid.sum())
        wrong += int((finite != valid).sum() + (gaps > OPEN).sum())
        largest = max(largest, float(gaps.max(initial=0.0)))
    return closed, wrong, largest


def _configurations(
    robot: chasles.Robot, numbers: Multistart, rng: np.random.Generator, is_map: bool
) -> tuple[dict[str, np.ndarray], np.ndarray, np.ndarray]:
    """Return random joint values keyed by name, and flags that mark valid and finite values."""
    if is_map:
        q = np.stack(list(_random(robot.coordinates, rng, numbers.size)), axis=-1)
        z = robot.configuration(q)
        names = [variable.name for variable in robot.configuration_variables]
        valid = (
            robot.loops_close(q) if hasattr(robot, "loops_close") else np.ones(len(q), dtype=bool)
        )
        return dict(zip(names, z.T, strict=True)), valid, np.isfinite(z).all(-1)
    theta = np.stack(list(_random(robot.chain_joints, rng, numbers.size)), axis=-1)
    q = robot.actuators(theta)
    values = dict(zip(numbers.chain, theta.T, strict=True))
    values |= dict(zip(numbers.actuated, q.T, strict=True))
    return values, robot.actuator_branches(theta).valid[:, 0], np.isfinite(q).all(-1)


def _random(coordinates: tuple, rng: np.random.Generator, size: float) -> Iterator[np.ndarray]:
    """Yield random coordinates from a range that is twice as wide as the joint limits."""
    for coordinate in coordinates:
        low, high = coordinate.lower, coordinate.upper
        if low is None or high is None or not np.isfinite(low) or not np.isfinite(high):
            low, high = (-np.pi, np.pi) if coordinate.unit == "rad" else (-size / 2, size / 2)
        middle, half = (low + high) / 2, WIDER * (high - low) / 2
        yield rng.uniform(middle - half, middle + half, BLOCK)


CAMPAIGN = Campaign(
    "loops",
    "Every configuration of a shipped robot closes its loops or is NaN.",
    trial,
)
