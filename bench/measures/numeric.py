"""Inverse kinematics by iteration, with the number of missed poses and the time per pose."""

import os
import time
from collections.abc import Callable
from functools import partial
from importlib import import_module

import numpy as np

import chasles
from tests.support.oracles.numeric_tasks import (
    ALONE,
    COMPARED,
    NumericTask,
    errors,
    missed,
    numeric_task,
)
from tests.support.oracles.screws import screws

from ..agreement import CONFIGURATIONS, require_same
from ..cores import one_core
from ..peers.forward import absent
from ..report import Limit, Plan, Ratio, out, ratio, seconds, table

OWN = "chasles"
POSES = 1000
CALL_BAR, BATCH_BAR = 4.0, 10.0
THREADS = 2


def run(plan: Plan) -> list[Ratio | Limit]:
    """Return missed poses, times and time ratios of all robots."""
    has_peer = "toolbox" not in absent()
    if not has_peer:
        out.print("the Robotics Toolbox is not installed: only ik_numeric is timed")
    found: list[Ratio | Limit] = []
    rows: list[tuple[object, ...]] = []
    for name in (*COMPARED, *ALONE):
        task = numeric_task(name, min(plan.calls, POSES))
        peer = _peer(name) if has_peer and name in COMPARED else None
        found += one_robot(task, peer, plan.rounds, rows)
    columns = ("us a call", "found", "largest error", "median", "mean", "99 of 100")
    table("Poses one by one, from Python", columns, rows)
    return found


def _peer(name: str) -> tuple[str, Callable]:
    module = import_module("tests.support.peers.toolbox_lm")
    robot = chasles.load(name)
    limits = robot.lower, robot.upper
    q = np.random.default_rng(0).uniform(*limits, (CONFIGURATIONS, robot.n))
    sequence = module.sequence(screws(name), *limits)
    require_same(f"{module.NAME} for {name}", map(sequence.eval, q), robot.fk(q))
    return module.NAME, module.inverse(screws(name), *limits)


def one_robot(
    task: NumericTask,
    peer: tuple[str, Callable] | None,
    rounds: int,
    rows: list[tuple[object, ...]],
) -> list[Ratio | Limit]:
    """Return missed poses, call times and time ratios for a robot, and append table rows."""
    solvers: dict[str, Callable] = {OWN: task.solve, **dict([peer] if peer else [])}
    poses = [pose.copy() for pose in task.T]
    taken: dict[str, list[np.ndarray]] = {name: [] for name in solvers}
    with one_core():
        for solve in solvers.values():
            solve(poses[0])
        for _ in range(rounds):
            for name, solve in solvers.items():
                taken[name].append(each_timed(solve, poses))
    robot = task.robot.name
    for name, solve in solvers.items():
        error = errors(task, [solve(pose) for pose in poses])
        share = f"{np.isfinite(error).mean():.1%}"
        times = (np.median(taken[name]), np.mean(taken[name]), np.percentile(taken[name], 99))
        largest = float(np.nanmax(error, initial=0))
        rows.append((f"{robot}: {name}", share, largest, *(float(t) / 1e3 for t in times)))
    found = [misses(task), *times_of(robot, taken[OWN])]
    return found + (ratios(task, taken, peer[0]) if peer else [])


def each_timed(solve: Callable, poses: list[np.ndarray]) -> np.ndarray:
    """Return the call time (m,) for each pose [ns]."""
    clock, taken = time.perf_counter_ns, np.empty(len(poses))
    for k, pose in enumerate(poses):
        start = clock()
        solve(pose)
        taken[k] = clock() - start
    return taken


def misses(task: NumericTask) -> Limit:
    """Return the number of poses without a valid solution within the limits."""
    key = f"{task.robot.name} ik_numeric, missed of {len(task.T)}"
    return Limit(key, float(missed(task)), "poses", 0)


def times_of(robot: str, rounds: list[np.ndarray]) -> list[Limit]:
    """Return median and mean call time in the fastest round."""
    return [
        Limit(f"{robot} ik_numeric, {name} call", min(map(of, rounds)) / 1e3, "us")
        for name, of in (("median", np.median), ("mean", np.mean))
    ]


def ratios(task: NumericTask, taken: dict[str, list[np.ndarray]], peer: str) -> list[Ratio]:
    """Return how many times slower the other library is than chasles.

    The results compare the median time of a call, the mean time of a call, and the time of a
    batch.
    """
    robot = task.robot.name
    found = []
    for word, of in (("median", np.median), ("mean", np.mean)):
        times = {name: [of(some) / 1e9 for some in rounds] for name, rounds in taken.items()}
        found.append(ratio(f"{robot} ik_numeric, {word}: {peer}", times, (OWN, peer), 1, CALL_BAR))
    if not hasattr(os, "sched_getaffinity") or len(os.sched_getaffinity(0)) < THREADS:
        out.print(f"fewer than {THREADS} cores: no comparison of ik_numeric batches with the peer")
        return found
    batch = partial(task.solve, task.T, THREADS)
    batch()
    totals = {OWN: [seconds(batch) for _ in taken[peer]]}
    totals[peer] = [some.sum() / 1e9 for some in taken[peer]]
    key = f"{robot} ik_numeric, a batch on {THREADS} threads: {peer}"
    return [*found, ratio(key, totals, (OWN, peer), len(task.T), BATCH_BAR)]
