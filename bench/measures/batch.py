"""Batches of poses in NumPy arrays, compared with memory bandwidth."""

import ctypes
import inspect
import os
import time
from collections.abc import Callable, Sequence

import numpy as np

import chasles

from ..cases.arms import ARMS, UR5E, Arm
from ..cores import one_core
from ..native.library import Loop
from ..peers.forward import Batch, setups
from ..report import Limit, Plan, Ratio, alternated, out, ratio

OWN = "chasles"
LOOP = "own C loop"
PEER = "Pinocchio C++"
BARS = {PEER: 10.0, LOOP: 4.0}
MEMSET_BAR = 0.6
NOT_ZERO = 7
"""Byte that memset writes. Some machines write zeros several times faster than other values."""
THREADS_BAR = 1.8


def run(plan: Plan) -> list[Ratio | Limit]:
    """Compare batches with other libraries, with memory bandwidth and with two threads."""
    with one_core():
        found = [
            row for measure in (there, new, roofline) for arm in ARMS for row in measure(plan, arm)
        ]
    return found + threads(plan)


def there(plan: Plan, arm: Arm) -> list[Ratio]:
    """Compare fk of a batch with compiled loops of other libraries.

    All functions write into an existing array.
    """
    q = _vectors(plan, arm)
    T = np.zeros((len(q), 4, 4))
    own = chasles.load(arm.name).fk
    works: dict[str, Callable[[], object]] = {OWN: lambda: own(q, out=T)}
    for loop in setups("loops", arm, plan.leave_out):
        works[_name(loop)] = lambda loop=loop: loop.fk(q, T)
    return _ratios(f"batch {arm.name} fk", works, plan)


def new(plan: Plan, arm: Arm) -> list[Ratio]:
    """Compare fk of a batch with other libraries, if each call allocates a new result array.

    The times include the time in which the operating system fills the array with zeros.
    """
    q = _vectors(plan, arm)
    batches: list[Batch] = setups("batches", arm, plan.leave_out)
    works: dict[str, Callable[[], object]] = {
        batch.name: lambda batch=batch: batch.fk(q) for batch in batches
    }
    for loop in setups("loops", arm, plan.leave_out):
        if loop.name == PEER:
            works[PEER] = lambda loop=loop: loop.fk(q, np.empty((len(q), 4, 4)))
    return _ratios(f"batch {arm.name} fk, new array", works, plan)


def _ratios(key: str, works: dict[str, Callable[[], object]], plan: Plan) -> list[Ratio]:
    times = alternated(works, plan.rounds)
    return [
        ratio(f"{key}: {name}", times, (OWN, name), plan.batch, BARS.get(name))
        for name in works
        if name != OWN
    ]


def _vectors(plan: Plan, arm: Arm) -> np.ndarray:
    return np.random.default_rng(0).uniform(-np.pi, np.pi, (plan.batch, arm.joints))


def _name(loop: Loop) -> str:
    return LOOP if loop.name == OWN else loop.name


def roofline(plan: Plan, arm: Arm) -> list[Ratio]:
    """Compare the time of fk_jacobian for a batch with memset on its result arrays."""
    q = _vectors(plan, arm)
    results = np.zeros((len(q), 4, 4)), np.zeros((len(q), 6, arm.joints))
    function = chasles.load(arm.name).fk_jacobian_mixed
    works = {
        OWN: lambda: function(q, out=results),
        "memset": lambda: [ctypes.memset(a.ctypes.data, NOT_ZERO, a.nbytes) for a in results],
    }
    times = alternated(works, plan.rounds)
    key = f"batch {arm.name} fk_jacobian: memset of the result"
    found = ratio(key, times, (OWN, "memset"), len(q), MEMSET_BAR)
    size = 8 * (16 + 6 * arm.joints)
    speeds = f"{size / found.own:.2f} GB/s, memset {size / found.peer:.2f} GB/s"
    out.print(f"{arm.name} fk with Jacobian, {size} bytes per pose: {speeds}")
    return [found]


def threads(plan: Plan) -> list[Ratio]:
    """Compare two threads with one thread."""
    function = chasles.load(UR5E.name).fk
    if "threads" not in inspect.signature(function).parameters:
        out.print("functions do not support threads=: no comparison on two cores")
        return []
    if len(os.sched_getaffinity(0)) < 2:
        out.print("only one core: no comparison on two cores")
        return []
    q = _vectors(plan, UR5E)
    T = np.zeros((len(q), 4, 4))
    works = {str(n): lambda n=n: function(q, out=T, threads=n) for n in (2, 1)}
    times: dict[str, Sequence[float]] = alternated(works, plan.rounds, time.perf_counter)
    return [ratio("batch ur5e fk, two threads: one", times, ("2", "1"), len(q), THREADS_BAR)]
