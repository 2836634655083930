"""Makes single memory allocations of runtime calls fail.

The script prints, as JSON, how often each call returned a result or raised an error. The script
runs with PYTHONMALLOC=malloc. LD_PRELOAD must contain the library that is compiled from
``native/failing_allocations.c``.
"""

import ctypes
import json
import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np

import chasles

OWN = f"{Path(chasles.__file__).parent}/".encode()
LOADS = 4
"""Approximate number of repetitions of a call that makes hundreds of memory allocations. In each
repetition, a different memory allocation fails."""
POSES = 20_000
"""Number of poses that are solved on two threads."""
LIBRARY = ctypes.PyDLL(None)
LIBRARY.fail_allocation.argtypes = [ctypes.c_char_p, ctypes.c_long]
LIBRARY.count_allocations.restype = ctypes.c_long


def calls() -> dict[str, Callable[[], object]]:
    """Return functions, keyed by name, that together call all compiled code of the runtime."""
    arm = chasles.load("ur5e")
    rng = np.random.default_rng(1)
    q, many = rng.uniform(-2, 2, (20, 6)), rng.uniform(-2, 2, (POSES, 6))
    large = rng.uniform(-2, 2, (15 * POSES, 6))
    T, V, path = arm.fk(q), rng.normal(size=(20, 6)), q[0] + np.linspace(0, 0.1, 10)[:, None]
    poses = arm.fk(path)
    return {
        "load": lambda: chasles.load("scara").fk([0.1, 0.2, 0.03, 0.4]),
        "load with loops": lambda: chasles.load("five_bar").fk([0.1, 0.2]),
        "fk": lambda: arm.fk(many, threads=2),
        "fk in pooled memory": lambda: arm.fk(large),
        "ik of one pose": lambda: arm.ik(T[0]).q,
        "ik": lambda: arm.ik(T).q,
        "valid": lambda: arm.ik(T).valid,
        "ik_nearest of one pose": lambda: arm.ik_nearest(T[0], q[0]).q,
        "ik_nearest": lambda: arm.ik_nearest(T, q).q,
        "ik_numeric": lambda: arm.ik_numeric(T[:5], q[:5]).q,
        "ik_path": lambda: arm.ik_path(poses, path[0]).q,
        "nearest": lambda: arm.ik(T).nearest(q),
        "sorted_by_distance": lambda: arm.ik(T).sorted_by_distance(q).q,
        "distinct": lambda: arm.ik(T).distinct().valid,
        "within_limits": lambda: arm.ik(T).within_limits().q,
        "joint_rates": lambda: arm.joint_rates(q, V, rate_limits=np.full(6, 0.3)).qd,
        "manipulability": lambda: arm.joint_rates(q, V, redundancy="manipulability").qd,
        "track": lambda: arm.track(poses, path[0], dt=0.01).q,
    }


def ends(call: Callable[[], object]) -> Counter[str]:
    """Make single memory allocations of a call fail, and count each result of the call."""
    expected = call()
    found = Counter()
    number = allocations(call)
    for k in range(0, number, max(1, number // LOADS)):
        found[end(call, k, expected)] += 1
        chasles.release_memory()
    if not np.array_equal(call(), expected, equal_nan=True):
        found["the call after the failures differs"] += 1
    chasles.release_memory()
    return found


def allocations(call: Callable[[], object]) -> int:
    chasles.release_memory()
    LIBRARY.fail_allocation(OWN, -1)
    call()
    return LIBRARY.count_allocations()


def end(call: Callable[[], object], k: int, expected: object) -> str:
    """Let the k-th memory allocation of a call fail.

    Returns a text that states how the call ends, such as "MemoryError".
    """
    LIBRARY.fail_allocation(OWN, k)
    try:
        result = call()
    except MemoryError:
        return "MemoryError"
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    finally:
        LIBRARY.fail_allocation(None, -1)
    same = np.array_equal(result, expected, equal_nan=True)
    return "the same result" if same else "another result"


json.dump({name: ends(call) for name, call in calls().items()}, sys.stdout)
