"""Time to compute the nearest solution or all solutions, in C and Python.

`ik` and `ik_nearest` are timed alternately, and each time is the minimum over many short loops. So
other processes hardly influence the times. Before the time measurement, the result of `ik_nearest`
is compared with `within_limits().nearest(q_seed)` for many poses.
"""

import ctypes
import time
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

import chasles
from tests.support.native import UNPACKED, Source, compiled

from ..agreement import require_same
from ..report import out, table

ROBOT = "ur5e"
POSES = 100_000
"""Number of poses at which `ik_nearest` is compared with `within_limits().nearest(q_seed)`."""
LIMIT = 1.15
"""Maximum ratio of the time of ik_nearest to the time of ik."""
CHAIN_US = 10.0
"""Maximum time of the filters within_limits, distinct and nearest on an idle machine [us]."""
ROUNDS, ROWS, MOVE = 300, 200, 0.05
BATCHES = (10, 100, 1000, POSES)
MAIN = """
#include "{robot}.c"
#define ROWS_OF(name, call)                                                   \\
    __attribute__((visibility("default"))) void name(                         \\
        const double *T, const double *q_seed, long count, double *out)       \\
    {{                                                                         \\
        for (long k = 0; k < count; k++, T += 16, q_seed += {n}) {{             \\
            call;                                                             \\
            __asm__ volatile("" : : "r"(out) : "memory");                     \\
        }}                                                                     \\
    }}
ROWS_OF(all_of, {robot}_ik(T, out, out + 256, out + 384))
ROWS_OF(nearest_of, {robot}_ik_nearest(T, q_seed, 0, 0, 0, out, out + 256, out + 384))
"""


def run() -> int:
    """Print the times and their ratios. Return 1 if a ratio exceeds the limit."""
    robot = chasles.load(ROBOT)
    T, near, far = poses(robot, POSES)
    agree(robot, T, near)
    agree(robot, T, far)
    out.print(f"{2 * POSES} results equal within_limits().nearest(q_seed)")
    rows = [("C", *in_C(robot, T, near)), ("Python, one call", *single(robot, T, near))]
    rows += [
        (f"Python, batch of {count}", *batch(robot, T[:count], near[:count])) for count in BATCHES
    ]
    cells = [(what, *times, times[1] / times[0]) for what, *times in rows]
    table(f"{ROBOT}, a pose", ("where", "ik ns", "ik_nearest ns", "ratio"), cells)
    solutions = robot.ik(T[0])
    filters, once = minima(
        (
            lambda: solutions.within_limits().distinct().nearest(near[0]),
            lambda: robot.ik(T[0]),
        ),
        20,
    )
    out.print(f"three filters: {filters / 1e3:.2f} us (ik in the same loop {once:.0f} ns)")
    out.print(f"bars: ratio {LIMIT}, filters {CHAIN_US} us on an idle machine")
    return int(any(cell[-1] > LIMIT for cell in cells))


def poses(robot: chasles.Robot, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return random reachable poses, seeds near a solution, and random seeds."""
    rng = np.random.default_rng(0)
    q = rng.uniform(-3, 3, (count, robot.n))
    near = q + rng.uniform(-MOVE, MOVE, q.shape)
    return robot.fk(q), near, rng.uniform(robot.lower, robot.upper, q.shape)


def agree(robot: chasles.Robot, T: np.ndarray, seeds: np.ndarray) -> None:
    """Compare the results of ik_nearest with the filters within_limits and nearest after ik.

    Raises:
        DisagreementError: A result differs.
    """
    for first in range(0, len(T), 2000):
        part = slice(first, first + 2000)
        found = robot.ik_nearest(T[part], seeds[part])
        expected = robot.ik(T[part]).within_limits().nearest(seeds[part])
        require_same("the filters", (expected,), (found.q,))


def minima(works: Sequence[Callable[[], object]], calls: int, rounds: int = ROUNDS) -> list[float]:
    """Return the minimum time per call of each function [ns]."""
    least = [np.inf] * len(works)
    for _ in range(rounds):
        for k, work in enumerate(works):
            start = time.perf_counter_ns()
            for _ in range(calls):
                work()
            least[k] = min(least[k], (time.perf_counter_ns() - start) / calls)
    return least


def in_C(robot: chasles.Robot, T: np.ndarray, seeds: np.ndarray) -> list[float]:
    """Measure the times of ik and ik_nearest in C, for calls with one pose."""
    main = MAIN.format(robot=robot.name, n=robot.n)
    files = {"main.c": main, **robot.manifest.sources()}
    source = Source(f"{robot.name}-nearest", files, (UNPACKED,))
    library = ctypes.CDLL(str(compiled(source)))
    poses, starts = np.ascontiguousarray(T[:ROWS]), np.ascontiguousarray(seeds[:ROWS])
    results = np.empty(512)
    arrays = [ctypes.c_void_p(array.ctypes.data) for array in (poses, starts, results)]
    given = (*arrays[:2], ctypes.c_long(ROWS), arrays[2])
    works = [partial(library.all_of, *given), partial(library.nearest_of, *given)]
    return [taken / ROWS for taken in minima(works, 1, 10 * ROUNDS)]


def single(robot: chasles.Robot, T: np.ndarray, seeds: np.ndarray) -> list[float]:
    """Return times of Python calls for one pose."""
    pose, seed = T[0].copy(), seeds[0].copy()
    return minima((lambda: robot.ik(pose), lambda: robot.ik_nearest(pose, seed)), 200)


def batch(robot: chasles.Robot, T: np.ndarray, seeds: np.ndarray) -> list[float]:
    """Return times per pose in a batch."""
    calls = max(1, 500 // len(T))
    rounds = ROUNDS if len(T) < POSES else 10
    works = (lambda: robot.ik(T), lambda: robot.ik_nearest(T, seeds))
    return [taken / len(T) for taken in minima(works, calls, rounds)]
