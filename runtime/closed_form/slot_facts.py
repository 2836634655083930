"""Coordinate data of a `Solutions` class, as arrays for the compiled filters."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import BoolArray, FloatArray, IntArray, real_array
from ..call._call import nearest_of_slots
from ..contract import Coordinate
from ..errors import InputValueError, ShapeError
from ..joint_limits import TURN, JointLimits
from ..size import limits_of
from ..tolerances import AT_LIMIT, SAME_SOLUTION


def moved_inside(
    joints: JointLimits,
    q: FloatArray,
    valid: BoolArray,
    q_seed: FloatArray,
    ends: Sequence[FloatArray],
    kind: Any,
) -> tuple[FloatArray, BoolArray]:
    """Return q (..., n) and valid.

    Full turns are added to q so that q is within the limits and near q_seed.
    """
    rows, judged = q.reshape(-1, 1, q.shape[-1]), np.where(valid, 0.0, np.inf).reshape(-1, 1)
    seeds = np.broadcast_to(q_seed, q.shape).reshape(-1, q.shape[-1])
    slots, seeds, facts = np.ascontiguousarray(rows), np.ascontiguousarray(seeds), facts_of(kind)
    lower, upper = np.concatenate([ends, [joints.lower, joints.upper]], -1)
    found = np.empty_like(seeds), *np.empty((2, len(rows))), np.empty(len(rows), np.int8)
    moves = lower, upper, 1 / facts.units, facts.turn
    nearest_of_slots(joints.functions[joints.inverse], (slots, judged, judged), seeds, moves, found)
    inside = (found[3] >= 0).reshape(valid.shape)
    return np.where(inside[..., None], found[0].reshape(q.shape), q), inside


@dataclass(frozen=True)
class SlotFacts:
    """Units, limits and full turns of the coordinates of a `Solutions` class.

    Attributes:
        units: (n,) the unit length for prismatic coordinates, 1 for revolute coordinates.
        turn: (n,) 2 pi for coordinates that wrap, otherwise 0.
        full: (n,) 2 pi for revolute coordinates, otherwise 0.
        lower: (n,) lower limits, -inf for none.
        upper: (n,) upper limits, inf for none.
        same: (n,) maximum coordinate differences between equal solutions.
    """

    units: FloatArray
    turn: FloatArray
    full: FloatArray
    lower: FloatArray
    upper: FloatArray
    same: FloatArray


@cache
def _facts_of(kind: Any) -> SlotFacts:
    items = kind.coordinates
    lower, upper = limits_of(items)
    units = np.array([kind.unit_length if c.unit == "m" else 1.0 for c in items])
    return SlotFacts(
        units=units,
        same=SAME_SOLUTION * units,
        full=np.where([c.unit == "m" for c in items], 0.0, TURN),
        turn=np.where(np.array(kind.wraps, dtype=np.bool_), TURN, 0.0),
        lower=lower,
        upper=upper,
    )


facts_of: Callable[[Any], SlotFacts] = _facts_of
"""Return the coordinate data (`SlotFacts`) of a `Solutions` class, from a cache."""


def windings_of(low: FloatArray, high: FloatArray, wraps: BoolArray) -> IntArray:
    """Return how many full turns (n,) cover the interval (low, high] of each coordinate."""
    turns = np.ceil((high - low) / TURN - AT_LIMIT)
    return np.where(wraps & np.isfinite(turns), np.maximum(turns, 1), 1).astype(np.intp)


def check_ascending(
    label: str, coordinates: Sequence[Coordinate], low: FloatArray, high: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return limits (n,). Raise an InputValueError if a lower limit exceeds the upper limit."""
    for c, a, b in zip(coordinates, low, high, strict=True):
        if not a <= b:
            raise InputValueError(
                f"{label}: {c.name} has limits {a:g} to {b:g} {c.unit}; the lower limit must not "
                "exceed the upper limit"
            )
    return low, high


def read_limits(
    coordinates: tuple[Coordinate, ...], label: str, limits: Any
) -> tuple[FloatArray, FloatArray]:
    """Return limits (n,) from an argument: "robot", None for none, or (n, 2)."""
    n = len(coordinates)
    if limits is None:
        return np.full(n, -np.inf), np.full(n, np.inf)
    if isinstance(limits, str):
        if limits != "robot":
            raise InputValueError(
                f'{label}: limits must be "robot", None or an array ({n}, 2), got {limits!r}'
            )
        return limits_of(coordinates)
    array = real_array(label, "limits", limits)
    if array.shape != (n, 2):
        raise ShapeError(f"{label}: limits must have shape ({n}, 2), got {array.shape}")
    return check_ascending(label, coordinates, array[:, 0].copy(), array[:, 1].copy())


def read_weights(n: int, label: str, weights: ArrayLike) -> FloatArray:
    """Return weights (n,) from an argument. Weights must be finite, not negative, and not all 0."""
    array = real_array(label, "weights", weights)
    if array.shape != (n,):
        raise ShapeError(f"{label}: weights must have shape ({n},), got shape {array.shape}")
    if not ((array >= 0) & np.isfinite(array)).all() or not array.any():
        raise InputValueError(
            f"{label}: weights must be finite and nonnegative, and at least one must be positive; "
            f"got {array.tolist()}"
        )
    return array
