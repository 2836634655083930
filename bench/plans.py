"""Defines the sections of the benchmarks and the plans for full, short and quick runs."""

from collections.abc import Callable
from dataclasses import replace

from .measures import accuracy, batch, growth, inverse, mechanisms, numeric, one_call, scalar, small
from .peers.forward import SLOW_TO_BUILD, is_built
from .report import Limit, Plan, Ratio

FULL = Plan(rounds=15, calls=10_000, batch=1_000_000)
SHORT = Plan(rounds=15, calls=2_000, batch=100_000)
QUICK = Plan(2, calls=500, batch=20_000, robots=("scara", "four_bar"), chains=(4, 8))

SECTIONS: dict[str, tuple[str, Callable[[Plan], list[Ratio | Limit]]]] = {
    "one_call": ("One call from Python", one_call.run),
    "scalar": ("Compiled code, pose after pose", scalar.run),
    "batch": ("A batch of poses from NumPy", batch.run),
    "mechanisms": ("Robots with loops", mechanisms.run),
    "inverse": ("Inverse kinematics, all solutions", inverse.run),
    "numeric": ("Inverse kinematics by iteration", numeric.run),
    "accuracy": ("Errors of poses and inverse solutions", accuracy.run),
    "small": ("Small things", small.run),
    "growth": (
        "Growth: a joint of a long chain compared with a joint of a short chain",
        growth.run,
    ),
}


def without_slow_builds(plan: Plan) -> Plan:
    """Return the plan without libraries that are not yet compiled and take long to compile."""
    return replace(plan, leave_out=frozenset(n for n in SLOW_TO_BUILD if not is_built(n)))
