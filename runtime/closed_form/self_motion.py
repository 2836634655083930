"""The best redundancy parameters over the self-motion of a redundant robot.

Samples cover the parameter ranges. Samples are denser if a small change of a parameter moves joints
far, for example near a wrist singularity. Random steps start from the best samples. If no random
step improves the result, the step length is halved. The optimum often lies at a limit. Steps in
fixed directions would stop too early at a limit, so the step directions are random.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np

from ..arrays import FloatArray
from ..errors import InputValueError
from ..fixed import values_at
from ..tolerances import SELF_MOTION_GAP, SELF_MOTION_MOVE, SELF_MOTION_STEP
from .slot_facts import facts_of

NearestRedundancy = Literal["fixed", "nearest", "limits", "manipulability"]
Objective = Callable[[FloatArray, FloatArray], FloatArray]
"""A function of coordinates (N, n) and seeds (N, n), whose values (N,) are maximized."""

_SAMPLES = {1: 64, 2: 20, 3: 12}
"""Number of samples for each redundancy parameter, keyed by the number of redundancy parameters."""
_FEW = 4
"""Number of samples for each redundancy parameter of a robot with more than three parameters."""
_FRACTIONS = np.linspace(0, 1, 5)
"""Relative positions of additional samples between two adjacent samples of a parameter."""
_INTERVALS = 16
"""Maximum number of intervals that are sampled with finer steps in each iteration."""
_STARTS = 8
"""Number of best samples that are refined."""
_DIRECTIONS = 5
"""Number of random steps from each sample of a robot with one redundancy parameter. For p
redundancy parameters, the number of random steps is ``_DIRECTIONS`` to the power p."""
_MAX_ROWS = 100_000
"""Maximum number of rows that are solved at once."""


def check_redundancy(label: str, redundancy: str) -> None:
    """Raise an InputValueError for an unknown value of `redundancy`."""
    if redundancy not in (known := get_args(NearestRedundancy)):
        other = "; resolve_redundancy of chasles.study.motion plans a whole path"
        listed, other = ", ".join(known), other * (redundancy == "global")
        raise InputValueError(f"{label}: redundancy: expected {listed}, got {redundancy!r}{other}")


def best_parameters(
    robot: Any,
    make: Callable[..., Any],
    objective: Objective,
    rows: tuple[FloatArray, FloatArray],
    fixed_q: Mapping[str, FloatArray],
    free: Sequence[str],
) -> dict[str, FloatArray]:
    """Return the parameters (N,) that maximize an objective, for targets and seeds."""
    target, seeds = rows
    per_row = _SAMPLES.get(len(free), _FEW) ** len(free) * len(_FRACTIONS)
    block = max(1, _MAX_ROWS // per_row)
    parts = []
    for first in range(0, len(seeds), block):
        part = slice(first, first + block)
        search = _Search(robot, make, objective, target[part], seeds[part])
        parts.append(search.best({name: v[part] for name, v in fixed_q.items()}, free))
    found = np.concatenate(parts) if parts else np.empty((0, len(free)))
    return {**fixed_q, **{name: found[:, k].copy() for k, name in enumerate(free)}}


@dataclass(frozen=True)
class _Search:
    robot: Any
    make: Callable[..., Any]
    objective: Objective
    target: FloatArray
    seeds: FloatArray

    def best(self, fixed_q: Mapping[str, FloatArray], free: Sequence[str]) -> FloatArray:
        start, low, high = self._ranges(free)
        per_axis = _SAMPLES.get(len(free), _FEW)
        unit = (np.arange(per_axis) + 0.5) / per_axis
        grid = np.array(list(itertools.product(unit, repeat=len(free))))
        values = low[:, None] + grid * (high - low)[:, None]
        values = np.concatenate([start[:, None], values], 1)
        samples = [values]
        if len(free) == 1:
            samples.append(self._refined(fixed_q, free, values[..., 0])[..., None])
        tops = [self._top(fixed_q, free, part) for part in samples]
        centers, best = (np.concatenate(part, 1) for part in zip(*tops, strict=True))
        step = np.repeat(((high - low) / per_axis)[:, None], centers.shape[1], 1)
        rng = np.random.default_rng(0)
        while (step > SELF_MOTION_STEP).any():
            offsets = rng.uniform(-1, 1, (_DIRECTIONS ** len(free), len(free)))
            near = centers[:, :, None] + offsets * step[:, :, None]
            near = np.clip(near, low[:, None, None], high[:, None, None])
            size = near.shape[1] * near.shape[2]
            found = self._values(fixed_q, free, near.reshape(len(near), size, -1))
            found = found.reshape(near.shape[:3])
            chosen = found.argmax(-1)
            is_better = found.max(-1) > best
            moved = np.take_along_axis(near, chosen[..., None, None], 2)[:, :, 0]
            centers = np.where(is_better[..., None], moved, centers)
            best = np.where(is_better, found.max(-1), best)
            step = np.where(is_better[..., None], step, step / 2)
        top = best.argmax(-1)
        return np.take_along_axis(centers, top[:, None, None], 1)[:, 0]

    def _top(
        self, fixed_q: Mapping[str, FloatArray], free: Sequence[str], values: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        found = self._values(fixed_q, free, values)
        order = np.argsort(-found, axis=1, kind="stable")[:, :_STARTS]
        centers = np.take_along_axis(values, order[..., None], 1)
        return centers, np.take_along_axis(found, order, 1)

    def _refined(
        self, fixed_q: Mapping[str, FloatArray], free: Sequence[str], values: FloatArray
    ) -> FloatArray:
        found: list[FloatArray] = []
        inner = np.sort(values, 1)[:, None]
        while inner.size:
            found.append(inner.reshape(len(values), -1))
            moves = self._joint_moves(fixed_q, free, found[-1]).reshape(inner.shape)[..., 1:]
            moves = np.where(np.diff(inner) > SELF_MOTION_GAP, moves, 0.0)
            parts = inner[..., :-1], inner[..., 1:], moves
            low, high, moves = (part.reshape(len(values), -1) for part in parts)
            # Rounding errors may move joints by more than SELF_MOTION_MOVE, even in the shortest
            # intervals.
            order = np.argsort(-moves, 1, kind="stable")[:, :_INTERVALS]
            is_far = np.take_along_axis(moves, order, 1) > SELF_MOTION_MOVE
            ends = (np.take_along_axis(end, order, 1) for end in (low, high))
            low, high = (np.where(is_far, end, np.nan)[:, is_far.any(0), None] for end in ends)
            inner = low + _FRACTIONS * (high - low)
        return np.sort(np.concatenate(found, 1), 1)

    def _joint_moves(
        self, fixed_q: Mapping[str, FloatArray], free: Sequence[str], values: FloatArray
    ) -> FloatArray:
        chosen, target, _ = self._at(fixed_q, free, values[..., None])
        q, residual, _ = chosen.inverse.ufunc(target, *chosen.parameters)
        q[~(residual <= chosen.inverse.near)] = np.nan
        facts = facts_of(chosen.inverse.solutions)
        moves = np.abs(np.diff(q, axis=0, prepend=np.nan))
        moves = np.minimum(moves, np.abs(moves - facts.turn)) / facts.units
        return np.asarray(np.nan_to_num(moves).max((-2, -1)).reshape(values.shape))

    def _ranges(self, free: Sequence[str]) -> tuple[FloatArray, FloatArray, FloatArray]:
        robot, moves = self.robot, self.make(self.seeds, {}).moves
        own = {item.name: item for item in robot.redundancy}
        start = np.stack([values_at(robot, name, self.seeds) for name in free], -1)
        low, high = np.empty_like(start), np.empty_like(start)
        joints = robot.joint_names if robot.manifest.loops.chain else ()
        for k, name in enumerate(free):
            index, bounds = own[name].index, (-np.inf, np.inf)
            if name in joints:
                bounds = tuple(robot.joint_limits[joints.index(name)])
            elif index is not None:
                bounds = moves.lower[index], moves.upper[index]
            half = np.pi if own[name].unit == "rad" else robot.unit_length
            center = np.clip(start[:, k], *bounds)
            low[:, k] = np.maximum(center - half, bounds[0])
            high[:, k] = np.minimum(center + half, bounds[1])
        return start, low, high

    def _values(
        self, fixed_q: Mapping[str, FloatArray], free: Sequence[str], values: FloatArray
    ) -> FloatArray:
        """Return the objective (N, m) at parameters (N, m, p), or -inf without a solution."""
        chosen, target, seeds = self._at(fixed_q, free, values)
        q, _, _, slot = chosen.solve(target, seeds)
        found = np.full(len(q), -np.inf)
        solved = slot >= 0
        with np.errstate(invalid="ignore"):
            value = self.objective(q[solved], seeds[solved])
        found[solved] = np.where(np.isnan(value), -np.inf, value)
        return found.reshape(values.shape[:2])

    def _at(
        self, fixed_q: Mapping[str, FloatArray], free: Sequence[str], values: FloatArray
    ) -> tuple[Any, FloatArray, FloatArray]:
        m = values.shape[1]
        target, seeds = np.repeat(self.target, m, 0), np.repeat(self.seeds, m, 0)
        at = {name: np.repeat(value, m) for name, value in fixed_q.items()}
        at |= {name: values[..., k].flatten() for k, name in enumerate(free)}
        return self.make(seeds, at, free=True), target, seeds
