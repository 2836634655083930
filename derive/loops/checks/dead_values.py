"""Finds the values of an actuated coordinate at which a loop has a dead point."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...model.mechanism import Coordinate
from ...terms.casadi_graph import lower
from ..functions.maps import margin
from ..solve.solved_loops import SolvedLoops

Floats = NDArray[np.float64]
PLACES = 4001
"""Number of coordinate values in the grid that is searched for zeros of a margin."""
HALVINGS = 60
OTHERS = 8
"""Number of coordinate values at which a margin is computed, to test whether the margin depends on
the coordinate."""
CHANGED = 1e-9
"""If a margin changes by less than this value along a coordinate, the margin counts as independent
of the coordinate."""


@dataclass(frozen=True)
class DeadValues:
    """The zeros of a margin that depends on only one actuated coordinate.

    Attributes:
        coordinate: Index of the actuated coordinate on which the margin depends.
        zeros: Coordinate values (radian or meter) within the coordinate limits at which the sign of
            the margin changes.
        least: Smallest value of the margin within the coordinate limits.
    """

    coordinate: int
    zeros: tuple[float, ...]
    least: float


def dead_values(h: SolvedLoops) -> tuple[DeadValues | None, ...]:
    """Return the zeros of each margin, or None for a margin whose zeros are not computed.

    Zeros are computed only for margins that depend on a single actuated coordinate. A revolute
    coordinate without limits is searched over a full turn. Zeros are not computed for a prismatic
    coordinate without limits. The search finds only zeros at which the margin changes its sign.
    """
    if not h.forward.margins:
        return ()
    kernel = lower([margin(h)], h.mechanism.name)[0]
    coordinates = h.mechanism.coordinates
    reference = h.q_at_reference
    ranges = [_range(coordinate) for coordinate in coordinates]

    def margins(index: int, values: Floats) -> Floats:
        q = np.repeat(reference[:, None], len(values), 1)
        q[index] = values
        return np.asarray(kernel(q)).reshape(-1, len(values))

    moved = [
        np.ptp(margins(k, reference[k] + np.linspace(-0.5, 0.5, OTHERS) * _width(r)), axis=1)
        for k, r in enumerate(ranges)
    ]
    # If a margin is NaN at some values of a coordinate, the margin counts as dependent on this
    # coordinate.
    depends = ~(np.array(moved) < CHANGED)

    def of(row: int) -> DeadValues | None:
        (indices,) = np.nonzero(depends[:, row])
        limits = ranges[indices[0]] if len(indices) == 1 else None
        if limits is None:
            return None
        index = int(indices[0])
        places = np.linspace(limits[0], limits[1], PLACES)
        values = margins(index, places)[row]
        (changes,) = np.nonzero(values[:-1] * values[1:] < 0)
        between = places[changes], places[changes + 1]
        zeros = _zeros(lambda x: margins(index, x)[row], *between) if len(changes) else ()
        return DeadValues(index, zeros, float(np.nanmin(values)))

    return tuple(map(of, range(depends.shape[1])))


def _range(coordinate: Coordinate) -> tuple[float, float] | None:
    lower, upper = coordinate.limits
    if lower is not None and upper is not None:
        return float(lower), float(upper)
    return (-math.pi, math.pi) if coordinate.unit == "rad" else None


def _width(limits: tuple[float, float] | None) -> float:
    return 1.0 if limits is None else limits[1] - limits[0]


def _zeros(function: Callable[[Floats], Floats], low: Floats, high: Floats) -> tuple[float, ...]:
    """Find the zeros of a function between pairs of bounds by bisection."""
    below = function(low) < 0
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        is_low = (function(middle) < 0) == below
        low, high = np.where(is_low, middle, low), np.where(is_low, high, middle)
    return tuple(map(float, (low + high) / 2))
