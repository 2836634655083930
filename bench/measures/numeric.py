"""Inverse kinematics by iteration: the number of missed reachable poses, and the time per pose."""

import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib import import_module

import numpy as np

import chasles
from tests.support.oracles.screws import screws

from ..cores import one_core
from ..peers.forward import absent
from ..report import Limit, Plan, Ratio, out, ratio, seconds, table

OWN = "chasles"
COMPARED = ("ur5e", "puma560", "panda")
ALONE = (
    *("iiwa14", "photo_robot", "lynxmotion", "jaco2"),
    *("well_manipulator", "board_installer", "stewart_gough"),
)
DIRECTION = (1, 1, 1, 1, 1, 0)
"""Weights for five joints: position and direction of the tool's z axis, any rotation about it."""
WEIGHTS = {"lynxmotion": DIRECTION}
"""The position determines the yaw of an arm on a turntable; the target adds the pitch."""
TOLERANCE = 1e-9
ROUNDING = 1e-13
"""Difference between a pose computed alone and the same pose in a batch [m or rad]."""
POSES = 1000
CALL_BAR, BATCH_BAR = 4.0, 10.0
THREADS = 2


@dataclass(frozen=True)
class Task:
    """Poses of a robot that it reaches within its limits.

    Attributes:
        robot: The robot.
        T: (m, 4, 4) poses.
        weights: Weights of the parts of the poses; None if all count equally.
    """

    robot: chasles.Robot
    T: np.ndarray
    weights: tuple[int, ...] | None

    def solve(self, T: np.ndarray, threads: int = 1):
        """The timed call, for a single pose or for all poses."""
        return self.robot.ik_numeric(T, weights=self.weights, threads=threads)


def run(plan: Plan) -> list[Ratio | Limit]:
    """Missed poses and times of all robots, and ratios of some robots to the peer."""
    has_peer = "toolbox" not in absent()
    if not has_peer:
        out.print("no Robotics Toolbox: ik_numeric is timed alone")
    found: list[Ratio | Limit] = []
    rows: list[tuple[object, ...]] = []
    for name in (*COMPARED, *ALONE):
        made = task(name, min(plan.calls, POSES))
        peer = _peer(name) if has_peer and name in COMPARED else None
        found += one_robot(made, peer, plan.rounds, rows)
    columns = ("us a call", "found", "largest error", "median", "mean", "99 of 100")
    table("Poses one by one, from Python", columns, rows)
    return found


def task(name: str, count: int) -> Task:
    """Poses at random coordinates within limits, or within half a turn or a metre of 0."""
    robot = chasles.load(name)
    reach = np.array([np.pi if c.unit == "rad" else 1.0 for c in robot.coordinates])
    lower = np.where(np.isfinite(robot.lower), robot.lower, -reach)
    upper = np.where(np.isfinite(robot.upper), robot.upper, reach)
    generator = np.random.default_rng(1)
    T = np.empty((0, 4, 4))
    while len(T) < count:
        more = robot.fk(generator.uniform(lower, upper, (count, robot.n)))
        T = np.vstack([T, more[np.isfinite(more).all((1, 2))]])
    return Task(robot, T[:count], WEIGHTS.get(name))


def _peer(name: str) -> tuple[str, Callable]:
    module = import_module("..peers.inverse.toolbox_lm", __package__)
    robot = chasles.load(name)
    return module.NAME, module.inverse(screws(name), robot.lower, robot.upper)


def one_robot(
    made: Task, peer: tuple[str, Callable] | None, rounds: int, rows: list[tuple[object, ...]]
) -> list[Ratio | Limit]:
    """Missed poses, times and ratios of a robot; appends a row of the table for each solver."""
    solvers: dict[str, Callable] = {OWN: made.solve, **dict([peer] if peer else [])}
    poses = [pose.copy() for pose in made.T]
    taken: dict[str, list[np.ndarray]] = {name: [] for name in solvers}
    with one_core():
        for solve in solvers.values():
            solve(poses[0])
        for _ in range(rounds):
            for name, solve in solvers.items():
                taken[name].append(each_timed(solve, poses))
    robot = made.robot.name
    for name, solve in solvers.items():
        error = errors(made, [solve(pose) for pose in poses])
        share = f"{np.isfinite(error).mean():.1%}"
        times = (np.median(taken[name]), np.mean(taken[name]), np.percentile(taken[name], 99))
        largest = float(np.nanmax(error, initial=0))
        rows.append((f"{robot}: {name}", share, largest, *(float(t) / 1e3 for t in times)))
    found = [missed(made), *times_of(robot, taken[OWN])]
    return found + (ratios(made, taken, peer[0]) if peer else [])


def each_timed(solve: Callable, poses: list[np.ndarray]) -> np.ndarray:
    """Times (m,) of the calls for each pose [ns]."""
    clock, taken = time.perf_counter_ns, np.empty(len(poses))
    for k, pose in enumerate(poses):
        start = clock()
        solve(pose)
        taken[k] = clock() - start
    return taken


def errors(made: Task, results: list) -> np.ndarray:
    """Errors (m,) of the poses [m or rad]; NaN without a claimed success or beyond a limit."""
    robot = made.robot
    q = np.array([result.q for result in results])
    claimed = np.array([bool(result.success) for result in results])
    within = ((q >= robot.lower) & (q <= robot.upper)).all(axis=1)
    return np.where(claimed & within, away(made, robot.fk(q)), np.nan)


def away(made: Task, T: np.ndarray) -> np.ndarray:
    """The larger of distance and angle (m,) between poses and the wanted poses [m or rad]."""
    distance = np.linalg.norm(T[:, :3, 3] - made.T[:, :3, 3], axis=1)
    columns = slice(2, 3) if made.weights == DIRECTION else slice(0, 3)
    sides = np.linalg.norm(T[:, :3, columns] - made.T[:, :3, columns], axis=(1, 2))
    # A small rotation moves two axes by its angle; if a single axis is compared, it moves once.
    return np.maximum(distance, sides if made.weights == DIRECTION else sides / np.sqrt(2))


def missed(made: Task) -> Limit:
    """The number of poses for which no valid solution within the limits is returned."""
    error = errors(made, [made.solve(pose) for pose in made.T])
    count = np.count_nonzero(~(error <= TOLERANCE + ROUNDING))
    return Limit(f"{made.robot.name} ik_numeric, missed of {len(error)}", float(count), "poses", 0)


def times_of(robot: str, rounds: list[np.ndarray]) -> list[Limit]:
    """Median and mean time of a call in the fastest round."""
    return [
        Limit(f"{robot} ik_numeric, {name} call", min(map(of, rounds)) / 1e3, "us")
        for name, of in (("median", np.median), ("mean", np.mean))
    ]


def ratios(made: Task, taken: dict[str, list[np.ndarray]], peer: str) -> list[Ratio]:
    """Ratios of medians and means in each round, and of a batch to the peer's single calls."""
    robot = made.robot.name
    found = []
    for word, of in (("median", np.median), ("mean", np.mean)):
        times = {name: [of(some) / 1e9 for some in rounds] for name, rounds in taken.items()}
        found.append(ratio(f"{robot} ik_numeric, {word}: {peer}", times, (OWN, peer), 1, CALL_BAR))
    if not hasattr(os, "sched_getaffinity") or len(os.sched_getaffinity(0)) < THREADS:
        out.print(f"fewer than {THREADS} cores: no batch of ik_numeric beside the peer")
        return found
    batch = partial(made.solve, made.T, THREADS)
    batch()
    totals = {OWN: [seconds(batch) for _ in taken[peer]]}
    totals[peer] = [some.sum() / 1e9 for some in taken[peer]]
    key = f"{robot} ik_numeric, a batch on {THREADS} threads: {peer}"
    return [*found, ratio(key, totals, (OWN, peer), len(made.T), BATCH_BAR)]
