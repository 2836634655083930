"""Compiled C of chasles and compiled C++ of other libraries, pose by pose."""

import numpy as np

from ..cases.arms import ARMS, Arm
from ..native.library import Loop, aligned
from ..peers.forward import setups, verified
from ..peers.forward.own import plain_loop
from ..report import Plan, Ratio, alternated, ratio

OWN = "chasles"
BARS = {"Pinocchio C++": 4.5, "wrenfold": 1.0, "SymForce": 1.0}
POSES = 100_000


def run(plan: Plan) -> list[Ratio]:
    """Return the time ratios of single C calls of fk and fk_jacobian for all arms."""
    return [row for arm in ARMS for row in one_arm(plan, arm)]


def one_arm(plan: Plan, arm: Arm) -> list[Ratio]:
    """Return the time ratios of single C calls for an arm."""
    loops: list[Loop] = [*setups("loops", arm, plan.leave_out), verified(plain_loop(arm), arm)]
    q = np.random.default_rng(0).uniform(-np.pi, np.pi, (min(POSES, plan.batch), arm.joints))
    T, J = aligned(1, 4, 4), aligned(1, 6, arm.joints)
    found = []
    for function, outputs in (("fk", (T,)), ("fk_jacobian", (T, J))):
        works = {
            loop.name: lambda loop=loop, name=function, to=outputs: getattr(loop, name)(q, *to)
            for loop in loops
        }
        times = alternated(works, plan.rounds)
        for loop in loops[1:]:
            key = f"scalar {arm.name} {function}: {loop.name}"
            found.append(ratio(key, times, (OWN, loop.name), len(q), BARS.get(loop.name)))
    return found
