"""Shorten a path by replacing the part between two of its points with a free straight segment.

Source:
    R. Geraerts, M. H. Overmars, Creating high-quality paths for motion planning, 2007.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from chasles.contract import check_type

from ..arguments import Rng, integer_at_least, key_of
from .plan import Plan, Space, plan_along

FloatArray = NDArray[np.float64]


def shortcut(space: Space, plan: Plan, *, attempts: int = 200, rng: Rng = 0) -> Plan:
    """Return a plan with its path shortened by free straight segments between points of the path.

    Args:
        space: The space in which the path was planned.
        plan: A `Plan` with the path to shorten. A plan without a path is returned unchanged.
        attempts: Number of attempts to replace the part between two random points of the path by a
            straight segment.
        rng: A seed (an int of at least 0), a `numpy.random.Generator`, or None for fresh random
            numbers.

    Raises:
        InputTypeError: `space` is not a `Space`, or `plan` is not a `Plan`.
        InputValueError: `attempts` is negative or not an integer.
    """
    check_type("shortcut: space", space, Space)
    check_type("shortcut: plan", plan, Plan)
    attempts = integer_at_least("shortcut: attempts", attempts, 0)
    if not plan.found:
        return plan
    random = np.random.default_rng(key_of("shortcut", rng))
    points, checked = plan.q, plan.n_checked
    for _ in range(attempts):
        steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
        at = np.r_[0, np.cumsum(steps)]
        low, high = np.sort(random.uniform(0, at[-1], 2))
        i, j = np.searchsorted(at, low, "right"), np.searchsorted(at, high, "left")
        if i >= j:
            continue
        a, b = (np.array([np.interp(x, at, column) for column in points.T]) for x in (low, high))
        checked += 1
        if space.is_free_segment(a, b):
            points = np.vstack([points[:i], a, b, points[j:]])
    return plan_along(points, checked)
