"""Shorter paths: two points of a path are joined directly where the way between them is free.

Source:
    R. Geraerts, M. H. Overmars, Creating high-quality paths for motion planning, 2007.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .roadmap import Plan, Space, plan_along

FloatArray = NDArray[np.float64]


def shortened(space: Space, plan: Plan, tries: int = 200, key: int = 0) -> Plan:
    """A path with corners cut off.

    Args:
        space: The space.
        plan: A plan; one without a path stays as it is.
        tries: Number of pairs of random points on the path that are tried.
        key: Chooses the random numbers.

    Returns:
        A free path that is no longer.
    """
    if not plan.found:
        return plan
    rng = np.random.default_rng(key)
    points, checked = plan.points, plan.checked
    for _ in range(tries):
        steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
        at = np.r_[0, np.cumsum(steps)]
        low, high = np.sort(rng.uniform(0, at[-1], 2))
        i, j = np.searchsorted(at, low, "right"), np.searchsorted(at, high, "left")
        if i >= j:
            continue
        a, b = (np.array([np.interp(x, at, column) for column in points.T]) for x in (low, high))
        checked += 1
        if space.free_way(a, b):
            points = np.vstack([points[:i], a, b, points[j:]])
    return plan_along(points, checked)
