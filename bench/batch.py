"""Many poses in one call from NumPy, on one core and on two; the memory's speed as a yardstick."""

import ctypes
import inspect
import os
from collections.abc import Callable, Sequence

import numpy as np

import chasles

from .arms import ARMS, UR5E, Arm
from .cores import one_core
from .native import Loop
from .peers import Batch, setups
from .report import Limit, Plan, Ratio, alternated, out, ratio

OWN, INTO = "chasles", "chasles into out="
BARS = {"Pinocchio C++": 10.0, "own C loop": 4.0}
MEMSET_BAR = 0.6
THREADS_BAR = 1.8


def run(plan: Plan) -> list[Ratio | Limit]:
    """Ratios of batches of fk to every peer, to the memory's speed and of two threads to one."""
    with one_core():
        found = [row for arm in ARMS for row in peers(plan, arm)]
        found += [row for arm in ARMS for row in roofline(plan, arm)]
    return found + threads(plan)


def peers(plan: Plan, arm: Arm) -> list[Ratio]:
    """A batch of fk beside compiled loops that write to memory, and beside JAX."""
    q = _vectors(plan, arm)
    T = np.zeros((len(q), 4, 4))
    loops: list[Loop] = setups("loops", arm, plan.leave_out)
    batches: list[Batch] = setups("batches", arm, plan.leave_out)
    own = batches[0].fk
    works: dict[str, Callable[[], object]] = {
        OWN: lambda: own(q),
        INTO: lambda: own(q, out=T),
        **{_name(loop): lambda loop=loop: loop.fk(q, T) for loop in loops},
        **{batch.name: lambda batch=batch: batch.fk(q) for batch in batches[1:]},
    }
    times = alternated(works, plan.rounds)
    return [
        ratio(f"batch {arm.name} fk: {name}", times, (OWN, name), len(q), BARS.get(name))
        for name in works
        if name != OWN
    ]


def _vectors(plan: Plan, arm: Arm) -> np.ndarray:
    return np.random.default_rng(0).uniform(-np.pi, np.pi, (plan.batch, arm.joints))


def _name(loop: Loop) -> str:
    return "own C loop" if loop.name == OWN else loop.name


def roofline(plan: Plan, arm: Arm) -> list[Ratio]:
    """fk with Jacobian beside memset of as many bytes, both into memory that is there."""
    q = _vectors(plan, arm)
    results = np.zeros((len(q), 4, 4)), np.zeros((len(q), 6, arm.joints))
    function = chasles.load(arm.name).fk_jacobian_mixed
    works = {
        OWN: lambda: function(q, out=results),
        "memset": lambda: [ctypes.memset(a.ctypes.data, 0, a.nbytes) for a in results],
    }
    times = alternated(works, plan.rounds)
    key = f"batch {arm.name} fk_jacobian: memset of the result"
    found = ratio(key, times, (OWN, "memset"), len(q), MEMSET_BAR)
    size = 8 * (16 + 6 * arm.joints)
    speeds = f"{size / found.own:.2f} GB/s, memset {size / found.peer:.2f} GB/s"
    out.print(f"{arm.name} fk with Jacobian, {size} bytes a pose: {speeds}")
    return [found]


def threads(plan: Plan) -> list[Ratio]:
    """Two threads beside one, where functions take `threads` and there are two cores."""
    function = chasles.load(UR5E.name).fk
    if "threads" not in inspect.signature(function).parameters:
        out.print("functions do not take threads=: nothing to compare on two cores")
        return []
    if len(os.sched_getaffinity(0)) < 2:
        out.print("only one core: nothing to compare on two")
        return []
    q = _vectors(plan, UR5E)
    T = np.zeros((len(q), 4, 4))
    works = {str(n): lambda n=n: function(q, out=T, threads=n) for n in (2, 1)}
    times: dict[str, Sequence[float]] = alternated(works, plan.rounds)
    return [ratio("batch ur5e fk, two threads: one", times, ("2", "1"), len(q), THREADS_BAR)]
