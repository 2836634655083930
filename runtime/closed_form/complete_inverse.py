"""Finds all solutions of an IK function with fixed joints, even at degenerate fixed values."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import BoolArray, FloatArray
from ..call._call import Function
from ..se3 import project
from ..tolerances import AT_REST_RATE, GIVEN_ASIDE, GIVEN_NEAR
from .refinement import Refinement
from .solutions import Solutions, solutions_of

_OTHER_VALUES = (0.5, 1.1, 1.9)
"""Test values [rad or m] of a fixed joint. If a relation between joint axes holds at all test
values, the relation is a property of the arm and not a degenerate case."""
_OTHER_RATES = (0.4, 0.73)
"""Differences [rad or m] between the test values of successive joints that are not fixed. A
relation between joint axes is accepted only if it holds for both differences."""
_SEARCH = 16
"""Number of Newton steps from each start. Further steps refine only points near a solution."""
_TURNS = 96
"""Number of start configurations per solution slot, with random values of the revolute joints."""


@dataclass(frozen=True)
class CompleteInverse:
    """Inverse with fixed joints that finds all solutions, even at degenerate fixed values.

    If a fixed value makes the adjacent axes parallel, perpendicular or coplanar, formulas for
    oblique axes miss solutions. Newton's method finds the missing solutions.

    Attributes:
        names: The fixed joints.
        solve: The inverse kinematics function, `solve(T, fixed={...})`.
        fk_jacobian_mixed: Forward kinematics of a serial robot.
        fixed: Indices of the fixed joints in q. The value () means that no solution is missing.
    """

    names: tuple[str, ...]
    solve: Callable[..., Solutions]
    fk_jacobian_mixed: Function[tuple[FloatArray, FloatArray]] | None
    fixed: tuple[int, ...]

    def complete(
        self, solutions: Solutions, T: ArrayLike, values: Mapping[str, ArrayLike]
    ) -> Solutions:
        """Return all solutions, even at degenerate fixed values.

        Slots for additional solutions have empty labels.
        """
        batch, kind = solutions.valid.shape[:-1], type(solutions)
        at = np.stack(np.broadcast_arrays(*(values[name] for name in self.names)), -1)
        is_finite = np.isfinite(at).all(-1) & np.isfinite(T).all((-2, -1))
        is_open = is_finite & self._is_degenerate(kind, at)
        if not is_open.any():
            return solutions
        at = np.broadcast_to(at, (*batch, at.shape[-1]))
        poses = project(np.broadcast_to(T, (*batch, 4, 4))[is_open], caller="ik")
        aside = (at[is_open] + GIVEN_ASIDE).T
        near = self.solve(poses, fixed=dict(zip(self.names, aside, strict=True)))
        # The zero row is a start configuration for poses whose solution slots are all NaN.
        zero = np.zeros((1, len(kind.wraps)))
        further: dict[tuple[int, ...], Solutions] = {}
        for row, index in enumerate(map(tuple, np.argwhere(is_open))):
            start = np.concatenate([solutions.q[index], near.q[row], zero])
            start[:, self.fixed] = at[index]
            q, residual, is_regular = self._found(kind, poses[row], start)
            # The margins are 0, because the solution steps are degenerate.
            found = kind(q, residual, 0 * residual, np.ones_like(is_regular))
            slots = kind(*(field[index] for field in solutions))
            further[index] = _fill(slots, found, is_regular)
        return _with_slots(solutions, further)

    def _is_degenerate(self, kind: type[Solutions], at: FloatArray) -> BoolArray:
        n, count = len(kind.wraps), len(self.fixed)
        others = np.outer(_OTHER_VALUES, 1 + np.arange(count) / 7)
        values = np.concatenate([at.reshape(-1, count), others])
        q = np.repeat(np.outer(_OTHER_RATES, 1 + np.arange(n))[:, None], len(values), 1)
        q[..., self.fixed] = values
        holds = (self._relations(q, kind.unit_length) <= GIVEN_ASIDE).all(0)
        special, always = np.split(holds, [-len(others)])
        return np.asarray((special & ~always.all(0)).any(-1)).reshape(at.shape[:-1])

    def _relations(self, q: FloatArray, unit: float) -> FloatArray:
        assert self.fk_jacobian_mixed is not None
        J = self.fk_jacobian_mixed(q)[1].mT
        v, omega = J[..., :3] / unit, J[..., 3:]
        axis = np.where(omega.any(-1, keepdims=True), omega, v * unit)
        pairs = itertools.combinations(self._free(q.shape[-1]), 2)
        across = [(a, b) for a, b in pairs if any(a < k < b for k in self.fixed)]
        a, b = np.array(across, dtype=np.intp).reshape(-1, 2).T
        first, second = axis[..., a, :], axis[..., b, :]
        product = v[..., a, :] * omega[..., b, :] + v[..., b, :] * omega[..., a, :]
        sine = np.linalg.norm(np.cross(first, second), axis=-1)
        parts = (sine, (first * second).sum(-1), product.sum(-1))
        return np.asarray(abs(np.concatenate(parts, -1)))

    def _free(self, n: int) -> list[int]:
        return [k for k in range(n) if k not in self.fixed]

    def _found(
        self, kind: type[Solutions], T: FloatArray, start: FloatArray
    ) -> tuple[FloatArray, FloatArray, BoolArray]:
        assert self.fk_jacobian_mixed is not None
        free = self._free(n := start.shape[-1])
        start = start[np.isfinite(start).all(-1)]
        _, first = np.unique(np.rint(start / GIVEN_NEAR), axis=0, return_index=True)
        turns = [k for k in free if kind.wraps[k]]
        start = np.repeat(start[first, None], 1 + _TURNS, axis=1)
        start[:, 1:, turns] = np.random.default_rng(0).uniform(-np.pi, np.pi, (_TURNS, len(turns)))
        start = start.reshape(-1, n)
        refine = Refinement(self.fk_jacobian_mixed, self.fixed, kind.unit_length)
        target = np.broadcast_to(T, (len(start), 4, 4))
        q, residual = refine.newton(target, start, _SEARCH)
        is_near = residual <= GIVEN_NEAR * kind.unit_length
        q, residual = refine.newton(target[is_near], q[is_near])
        q, residual = (field[residual <= kind.tolerance] for field in (q, residual))
        J = self.fk_jacobian_mixed(q)[1][..., free]
        is_regular = np.linalg.svd(J, compute_uv=False)[..., -1] > AT_REST_RATE
        order = np.argsort(~is_regular, kind="stable")
        return q[order], residual[order], is_regular[order]


def _fill(slots: Solutions, found: Solutions, is_regular: BoolArray) -> Solutions:
    k, kind = len(slots.valid), cast("Any", type(slots))
    both = kind(*map(np.concatenate, zip(slots, found, strict=True))).distinct()
    slots.valid[:] = both.valid[:k]
    new = k + np.flatnonzero(both.valid[k:])
    empty = np.flatnonzero(~slots.valid)[: len(new)]
    for field, values in zip(slots, both, strict=True):
        field[empty] = values[new[: len(empty)]]
    rest = new[len(empty) :]
    # A self-motion has a singular solution at every point.
    rest = rest[is_regular[rest - k]]
    return cast("Solutions", kind(*(field[rest] for field in both)))


def _with_slots(slots: Solutions, further: Mapping[tuple[int, ...], Solutions]) -> Solutions:
    if not (most := max(len(more.valid) for more in further.values())):
        return slots
    labels = (*slots.labels, *[""] * most) if slots.labels else ()
    facts = slots.coordinates, slots.wraps, labels, slots.unit_length
    kind = solutions_of(*facts, joint_limits=slots.joint_limits)
    shape = (*slots.valid.shape[:-1], most)
    q = np.full((*shape, slots.q.shape[-1]), np.nan)
    added = kind(q, np.full(shape, np.inf), np.zeros(shape), np.zeros(shape, np.bool_))
    for index, more in further.items():
        for field, values in zip(added, more, strict=True):
            field[index][: len(more.valid)] = values
    pairs = zip(slots, added, strict=True)
    return kind(*(np.concatenate(pair, len(shape) - 1) for pair in pairs))
