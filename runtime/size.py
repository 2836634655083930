"""The size of a robot, and the length that is equivalent to 1 rad in tolerances.

The size is the root mean square distance of the tip from its mean position over the joint limits.
The unit length is 1 m for robots from 0.03 m to 30 m.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from .arrays import BoolArray, FloatArray
from .contract import Coordinate, Reference
from .sampling import low_discrepancy
from .tolerances import AT_LIMIT, MIN_SIZE

_SAMPLES = 256
"""Number of sampled configurations; more samples change a computed length by about 1 %."""
_CLOSED, _HALVINGS = 32, 6
"""Minimum number of samples with closed loops, and maximum number of halvings of the sampling
range."""


def ranges(
    coordinates: Sequence[Coordinate], reference: Reference | None
) -> tuple[FloatArray, FloatArray]:
    """Return the lower and upper ends (n,) of the sampling ranges.

    A missing limit is replaced by the value pi rad or 1 m away from a center. The center is the
    reference. Without a reference, the center is 0, or the other limit if 0 violates that limit.
    """
    center = np.zeros(len(coordinates)) if reference is None else np.array(reference.q)
    lower, upper = limits_of(coordinates)
    half = np.array([np.pi if c.unit == "rad" else 1.0 for c in coordinates])
    lower = np.where(np.isfinite(lower), lower, np.minimum(center, upper) - half)
    upper = np.where(np.isfinite(upper), upper, np.maximum(center, lower) + half)
    return lower, upper


def limits_of(coordinates: Sequence[Any]) -> tuple[FloatArray, FloatArray]:
    """Return lower and upper limits (n,), infinite if missing."""
    lower = np.array([-np.inf if c.lower is None else c.lower for c in coordinates])
    return lower, np.array([np.inf if c.upper is None else c.upper for c in coordinates])


def within(q: FloatArray, lower: FloatArray, upper: FloatArray, units: FloatArray) -> BoolArray:
    """Test whether coordinates (..., n) are within limits (n,), up to rounding in units (n,)."""
    rounding = AT_LIMIT * units
    return np.asarray((q >= lower - rounding) & (q <= upper + rounding))


def configurations(coordinates: Sequence[Coordinate], reference: Reference | None) -> FloatArray:
    """Return coordinates (256, n) that are evenly distributed over the coordinate ranges."""
    lower, upper = ranges(coordinates, reference)
    points = low_discrepancy(1, _SAMPLES + 1, len(coordinates))
    return np.asarray(lower + points * (upper - lower))


def unit_length(
    fk: Callable[[FloatArray], FloatArray],
    coordinates: Sequence[Coordinate],
    reference: Reference | None,
) -> float:
    """Return the unit length [m]: the power of 1000 nearest to the size, 1 m for a fixed tip."""
    p = _positions(fk, configurations(coordinates, reference), reference)
    if not len(p):
        return 1.0
    spread = math.sqrt(float(((p - p.mean(0)) ** 2).sum(-1).mean()))
    away = math.sqrt(float((p**2).sum(-1).mean()))
    size = max(spread, MIN_SIZE * away)
    return 1000.0 ** round(math.log(size, 1000)) if size > 0 else 1.0


def _positions(
    fk: Callable[[FloatArray], FloatArray], q: FloatArray, reference: Reference | None
) -> FloatArray:
    middle = q.mean(0) if reference is None else np.array(reference.q)
    best = np.zeros((0, 3))
    for _ in range(1 + _HALVINGS):
        p = fk(q)[:, :3, 3]
        p = p[np.isfinite(p).all(-1)]
        best = max(best, p, key=len)
        if len(p) >= _CLOSED:
            break
        q = (q + middle) / 2
    return best
