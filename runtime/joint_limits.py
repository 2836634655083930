"""Limits of joints whose values follow from the coordinates of a robot."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .arrays import BoolArray, FloatArray
from .contract import LimitedVariable, Manifest
from .size import limits_of, within
from .tolerances import AT_LIMIT

TURN = 2 * np.pi


@dataclass(frozen=True)
class JointLimits:
    """Limits of the joint values theta (..., m), which are functions of the coordinates q.

    Attributes:
        chain: The function from q to theta, or to the configuration of a robot with loops.
        lower: Lower limits of theta (m,). The limit is -inf for joints that are coordinates.
        upper: Upper limits of theta (m,).
        inverse: The name of the inverse kinematics function.
        functions: The functions of the robot, keyed by name.
        limited: The passive variables that have limits, for a robot with loops.
    """

    chain: Callable[[FloatArray], FloatArray]
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    inverse: str
    functions: Mapping[str, Any] = field(compare=False, repr=False)
    limited: tuple[LimitedVariable, ...] = ()

    def values(self, q: FloatArray) -> FloatArray:
        """Return theta (..., m), with passive angles shifted above their lower limits by turns."""
        if not self.limited:
            return self.chain(q)
        theta: FloatArray = self.chain(q)[..., [v.index for v in self.limited]]
        low = np.array(self.lower) - AT_LIMIT
        turns = [v.turns for v in self.limited]
        theta[..., turns] = low[turns] + np.mod(theta[..., turns] - low[turns], TURN)
        return theta

    def inside(self, q: FloatArray) -> BoolArray:
        """Test which joints (..., m) at coordinates (..., n) are within their limits."""
        lower, upper = np.array(self.lower), np.array(self.upper)
        return within(self.values(q), lower, upper, np.ones_like(lower))


def joint_limits_of(
    manifest: Manifest, functions: Mapping[str, Any], inverse: str
) -> JointLimits | None:
    """Return the limits of dependent joints, or None if q determines no other joints."""
    if limited := manifest.loops.limited:
        low, high = (tuple(ends.tolist()) for ends in limits_of(limited))
        return JointLimits(functions["configuration"], low, high, inverse, functions, limited)
    joints, C = manifest.loops.chain, np.array(manifest.loops.coupling)
    if not len(C) or "chain" not in functions:
        return None
    chain = functions["chain"]
    is_own = ((C != 0).sum(1) == 1) & (chain(np.zeros(C.shape[1])) == 0)
    is_own &= [joint in manifest.coordinates for joint in joints]
    lower, upper = limits_of(joints)
    lower[is_own], upper[is_own] = -np.inf, np.inf
    return JointLimits(chain, tuple(lower.tolist()), tuple(upper.tolist()), inverse, functions)
