"""The coordinates of a class of solutions, as arrays for the compiled filters."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..contract import Coordinate
from ..errors import InputValueError
from ..size import limits_of
from ..tolerances import AT_LIMIT, SAME_SOLUTION

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.intp]
TURN = 2 * math.pi


@dataclass(frozen=True)
class SlotFacts:
    """The coordinates of a class of solutions, as arrays.

    Attributes:
        units: (n,) the robot's unit of length for slides, 1 for coordinates that turn.
        turn: (n,) 2 pi for coordinates that wrap, else 0.
        whole: (n,) 2 pi for coordinates that turn, else 0.
        lower: (n,) lower limits, -inf for none.
        upper: (n,) upper limits, inf for none.
        same: (n,) differences up to which coordinates of the same solution may differ.
    """

    units: FloatArray
    turn: FloatArray
    whole: FloatArray
    lower: FloatArray
    upper: FloatArray
    same: FloatArray


@cache
def _facts_of(kind: Any) -> SlotFacts:
    items = kind.coordinates
    lower, upper = limits_of(items)
    units = np.array([kind.unit if c.unit == "m" else 1.0 for c in items])
    return SlotFacts(
        units=units,
        same=SAME_SOLUTION * units,
        whole=np.where([c.unit == "m" for c in items], 0.0, TURN),
        turn=np.where(np.array(kind.wraps, dtype=np.bool_), TURN, 0.0),
        lower=lower,
        upper=upper,
    )


facts_of: Callable[[Any], SlotFacts] = _facts_of
"""The coordinates of a class of solutions."""


def windings_of(low: FloatArray, high: FloatArray, wraps: BoolArray) -> IntArray:
    """(n,) number of turns listed for a coordinate: those in (low, high], rounded up."""
    turns = np.ceil((high - low) / TURN - AT_LIMIT)
    return np.where(wraps & np.isfinite(turns), np.maximum(turns, 1), 1).astype(np.intp)


def check_ascending(
    label: str, coordinates: Sequence[Coordinate], low: FloatArray, high: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The limits (n,); raises an InputValueError if a lower one is above its upper one, or NaN."""
    for c, a, b in zip(coordinates, low, high, strict=True):
        if not a <= b:
            raise InputValueError(
                f"{label}: {c.name} has limits {a:g} to {b:g} {c.unit}; the lower one must not be "
                "above the upper one"
            )
    return low, high
