"""The size of a robot, and the length that counts as much as a radian in its tolerances.

Lengths are judged in the power of 1000 [m] nearest to the size of the workspace: the root mean
square distance of the tip from the mean of its positions, over configurations that fill the limits.
It is 1 m for robots of 0.03 m to 30 m.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from .arrays import BoolArray, FloatArray
from .contract import Coordinate, Reference
from .sampling import low_discrepancy
from .tolerances import AT_LIMIT, LEAST_SIZE

_SAMPLES = 256
"""Configurations that stand for all; with more, a length changes by a percent."""
_CLOSED, _HALVINGS = 32, 6
"""Configurations that have to close their loops; where fewer do, those half as far from the
reference are taken, and so on."""


def ranges(
    coordinates: Sequence[Coordinate], reference: Reference | None
) -> tuple[FloatArray, FloatArray]:
    """(n,) the least and the greatest values of coordinates: their limits, else a turn or 2 m."""
    centre = np.zeros(len(coordinates)) if reference is None else np.array(reference.q)
    lower, upper = limits_of(coordinates)
    half = np.array([np.pi if c.unit == "rad" else 1.0 for c in coordinates])
    lower = np.where(np.isfinite(lower), lower, np.minimum(centre, upper) - half)
    upper = np.where(np.isfinite(upper), upper, np.maximum(centre, lower) + half)
    return lower, upper


def limits_of(coordinates: Sequence[Coordinate]) -> tuple[FloatArray, FloatArray]:
    """(n,) lower and upper limits, infinite where there are none."""
    lower = np.array([-np.inf if c.lower is None else c.lower for c in coordinates])
    return lower, np.array([np.inf if c.upper is None else c.upper for c in coordinates])


def within(q: FloatArray, lower: FloatArray, upper: FloatArray, units: FloatArray) -> BoolArray:
    """Whether coordinates (..., n) are within limits (n,), up to rounding in units (n,)."""
    rounding = AT_LIMIT * units
    return np.asarray((q >= lower - rounding) & (q <= upper + rounding))


def configurations(coordinates: Sequence[Coordinate], reference: Reference | None) -> FloatArray:
    """(256, n) coordinates that fill the ranges."""
    lower, upper = ranges(coordinates, reference)
    points = low_discrepancy(1, _SAMPLES + 1, len(coordinates))
    return np.asarray(lower + points * (upper - lower))


def unit_length(
    fk: Callable[[FloatArray], FloatArray],
    coordinates: Sequence[Coordinate],
    reference: Reference | None,
) -> float:
    """The power of 1000 [m] nearest to the size of the workspace; 1 m if it is a point."""
    p = _positions(fk, configurations(coordinates, reference), reference)
    if not len(p):
        return 1.0
    spread = math.sqrt(float(((p - p.mean(0)) ** 2).sum(-1).mean()))
    away = math.sqrt(float((p**2).sum(-1).mean()))
    size = max(spread, LEAST_SIZE * away)
    return 1000.0 ** round(math.log(size, 1000)) if size > 0 else 1.0


def _positions(
    fk: Callable[[FloatArray], FloatArray], q: FloatArray, reference: Reference | None
) -> FloatArray:
    """Positions (k, 3) of the tip where loops close, at configurations or nearer the reference."""
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
