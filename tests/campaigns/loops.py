"""``python -m bench loops``: many configurations of the shipped robots with loops.

Coordinates are drawn from twice the range of the limits, far out of reach. Where a robot says that
its loops close, every number must close them, by the frames of its description alone; elsewhere
every result must be NaN. Platforms are asked for the actuators of random poses instead.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

import chasles
from bench.report import out
from chasles.derive import load
from chasles.derive.model.mechanism import Mechanism
from tests.support.oracles.multi_start import Multistart

ROBOTS = Path(__file__).parents[2] / "derive" / "robots"
BLOCK = 20_000
WIDER = 2.0
"""Range of the coordinates, in ranges of their limits."""
OPEN = 1e-12
"""Gap of a closed loop, parts of the robot's size."""


def run(count: int) -> int:
    """Prints a line for each robot; returns 1 if a number is wrong.

    Args:
        count: Number of configurations of each robot.
    """
    wrong = 0
    for path in sorted(ROBOTS.glob("*.toml")):
        mechanism = load(path)
        if isinstance(mechanism, Mechanism) and mechanism.closers:
            closed, off, largest = judged(mechanism, count)
            wrong += off
            out.print(
                f"{path.stem}: {count} configurations, {closed} closed, {off} wrong, "
                f"largest gap {largest:.1e} of the size"
            )
    return int(wrong > 0)


def judged(mechanism: Mechanism, count: int) -> tuple[int, int, float]:
    """Number of closed configurations, number of wrong ones, and the largest gap."""
    robot, numbers = chasles.load(mechanism.name), Multistart(mechanism)
    rng = np.random.default_rng(0)
    is_map = robot.solution == "closed form"
    closed, wrong, largest = 0, 0, 0.0
    for _ in range(0, count, BLOCK):
        values, valid, finite = _asked(robot, numbers, rng, is_map)
        gaps = numbers.gaps({name: of[finite] for name, of in values.items()})
        closed += int(valid.sum())
        wrong += int((finite != valid).sum() + (gaps > OPEN).sum())
        largest = max(largest, float(gaps.max(initial=0.0)))
    return closed, wrong, largest


def _asked(
    robot: chasles.Robot, numbers: Multistart, rng: np.random.Generator, is_map: bool
) -> tuple[dict[str, np.ndarray], np.ndarray, np.ndarray]:
    """Values of all joints by name, where they are said to be valid, and where they are finite."""
    if is_map:
        q = np.stack(list(_random(robot.coordinates, rng, numbers.size)), axis=-1)
        z = robot.configuration(q)
        names = [variable.name for variable in robot.configuration_variables]
        # Loops that close everywhere have no margin.
        valid = robot.valid(q) if hasattr(robot, "valid") else np.ones(len(q), dtype=bool)
        return dict(zip(names, z.T, strict=True)), valid, np.isfinite(z).all(-1)
    theta = np.stack(list(_random(robot.chain_joints, rng, numbers.size)), axis=-1)
    q = robot.actuators(theta)
    values = dict(zip(numbers.chain, theta.T, strict=True))
    values |= dict(zip(numbers.actuated, q.T, strict=True))
    return values, robot.actuator_branches(theta).valid[:, 0], np.isfinite(q).all(-1)


def _random(coordinates: tuple, rng: np.random.Generator, size: float) -> Iterator[np.ndarray]:
    """Values of each coordinate, over and beyond its limits."""
    for coordinate in coordinates:
        low, high = coordinate.lower, coordinate.upper
        if low is None or high is None or not np.isfinite(low) or not np.isfinite(high):
            low, high = (-np.pi, np.pi) if coordinate.unit == "rad" else (-size / 2, size / 2)
        middle, half = (low + high) / 2, WIDER * (high - low) / 2
        yield rng.uniform(middle - half, middle + half, BLOCK)
