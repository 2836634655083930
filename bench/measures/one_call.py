"""Single calls from Python: a pose, and a pose with its Jacobian."""

from collections.abc import Callable, Sequence

import numpy as np

from ..cases.arms import ARMS, Arm
from ..native.library import aligned
from ..peers.forward import Call, setups
from ..report import Limit, Plan, Ratio, alternated, ratio

OVERHEAD_NS = 100
"""Time that a call from Python may add to the C function [ns]."""
OWN = "chasles"
KERNEL = "the C alone"
VECTORS = 500


def run(plan: Plan) -> list[Ratio | Limit]:
    """Return ratios to other libraries, and the overhead of a Python call over C."""
    return [row for arm in ARMS for row in one_arm(plan, arm)]


def one_arm(plan: Plan, arm: Arm) -> list[Ratio | Limit]:
    """Compare the call times of other libraries and of chasles for one arm.

    The results also contain the overhead of a Python call over C.
    """
    calls: list[Call] = setups("calls", arm, plan.leave_out)
    q = np.random.default_rng(0).uniform(-np.pi, np.pi, (VECTORS, arm.joints))
    repeats = max(plan.calls // VECTORS, 1)
    found: list[Ratio | Limit] = []
    for function in ("fk", "fk_jacobian"):
        works = {call.name: repeated(getattr(call, function), q, repeats) for call in calls}
        works[KERNEL] = _kernel(arm, function, q, repeats)
        times = alternated(works, plan.rounds)
        count = repeats * VECTORS
        for call in calls[1:]:
            key = f"python {arm.name} {function}: {call.name}"
            found.append(ratio(key, times, (OWN, call.name), count))
        found.append(_overhead(f"python {arm.name} {function}: call beyond the C", times, count))
    return found


def repeated(work: Callable[[np.ndarray], object], q: np.ndarray, repeats: int):
    """Return a function that calls `work` for each row of q, `repeats` times."""
    vectors = [vector.copy() for vector in q] * repeats

    def repeat() -> None:
        for vector in vectors:
            work(vector)

    return repeat


def _kernel(arm: Arm, function: str, q: np.ndarray, repeats: int) -> Callable[[], None]:
    loop = setups("loops", arm, only=("own",))[0]
    many = np.tile(q, (repeats, 1))
    results = [aligned(1, 4, 4), aligned(1, 6, arm.joints)]
    outputs = results if function == "fk_jacobian" else results[:1]
    return lambda: getattr(loop, function)(many, *outputs)


def _overhead(key: str, times: dict[str, Sequence[float]], count: int) -> Limit:
    beyond = [call - c for call, c in zip(times[OWN], times[KERNEL], strict=True)]
    return Limit(key, float(np.median(beyond)) / count * 1e9, "ns", OVERHEAD_NS)
