"""Refines solutions with small residuals for targets without a valid solution slot.

If several solution steps are nearly singular, a closed form loses digits or misses a solution.
Newton's method restores the lost digits and finds the missed solution. For rounded poses, the
refinement returns least-squares solutions (see docs/explanation).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import BoolArray, FloatArray, IntArray
from ..call._call import RIGID_TO_ROUNDING, Function, rounded_residuals
from ..contract import FunctionInfo, Manifest
from ..se3 import project
from ..tolerances import (
    AT_REST,
    AT_REST_BEND,
    AT_REST_RATE,
    BEND_STEP,
    REFINED,
    SADDLE,
    SADDLE_BEND,
    SADDLE_STEP,
    SOLVED,
)
from .polish import BLOCK, STEPS, iterate
from .task_components import WHOLE, Task

Gradients = Callable[[IntArray, FloatArray], tuple[FloatArray, FloatArray]]
"""Maps target indices (N,) and coordinates (N, n) to half the squared errors f (N,) and to the
gradients (N, n) of f."""
_LONGEST = 1.0
"""Maximum distance of a start configuration from the saddle [rad or length]."""


class DescentStarts(NamedTuple):
    """Start configurations q (M, n) on both sides of saddles, with input row indices `row` (M,)."""

    row: IntArray
    q: FloatArray


_Fields = tuple[FloatArray, FloatArray, BoolArray]
"""Coordinates (..., k, n), residuals (..., k) and validity (..., k) of all solution slots."""

_SEARCH = 12
"""Maximum number of Newton steps if the start configuration is far from the solution.

After these steps, only slots near a solution are refined further. At a double solution, a step
divides the error by 4.
"""
_ROUNDED_STEPS = 8
"""Number of steps to a least-squares solution of a rounded pose."""
_GROWTH = 10.0
"""Maximum factor by which a closed form amplifies the rounding error of a pose."""
_ASIDE = 0.25
"""Maximum fraction of the squared pose error that lies in singular directions."""
_VALUES = 16
"""Number of values, evenly spaced over a full turn, at which a joint is fixed."""


@dataclass(frozen=True, slots=True)
class Refinement:
    """Newton's method that refines inexact closed-form solutions to valid solutions.

    Attributes:
        fk_jacobian_mixed: The function ``fk_jacobian_mixed`` of the robot.
        fixed: Indices of coordinates that keep their values.
        unit: The unit length [m] of the robot, used by the iteration.
        task: The task of the IK function: a pose, or the prescribed components of a pose.
        judged: The unit length [m] of residuals and tolerances, which is 1 m for some tasks.
        searches: Whether all solution slots are refined, because the closed form misses solutions.
        is_determined: Whether all inputs of the inverse kinematics function are coordinates. The
            value is False if an input is a swivel angle, which a self-motion would change.
    """

    fk_jacobian_mixed: Function[tuple[FloatArray, FloatArray]]
    fixed: tuple[int, ...]
    unit: float = 1.0
    task: Task = WHOLE
    judged: float = 1.0
    searches: bool = False
    is_determined: bool = True

    @property
    def near(self) -> float:
        """Maximum residual [m] up to which a solution is refined."""
        return np.inf if self.searches else REFINED * self.judged

    def __call__(
        self, inputs: tuple[FloatArray, ...], q: FloatArray, residual: FloatArray, valid: BoolArray
    ) -> None:
        """Refine slots in place."""
        targets = np.broadcast_to(inputs[0], (*valid.shape[:-1], *self.task.shape))
        missed = np.asarray(~valid.any(-1))
        aside = self._is_aside(targets, q, residual, missed)
        within = np.where(aside, np.inf, self.near)
        tried = np.isfinite(residual) & (residual <= within[..., None]) & missed[..., None]
        some = tried.any(-1)
        enough = np.full(missed.shape, SOLVED * self.judged)
        enough[some] = self.enough(targets[some])
        # An exact translation may look rounded. A tolerance for rounded poses would then accept a
        # solution for a different pose.
        is_doubtful = np.asarray(enough > SOLVED * self.judged)
        # For a task that prescribes only a part of the pose, `is_doubtful` is always False.
        if is_doubtful.any():
            is_doubtful[is_doubtful] = self._is_at_right_angles(targets[is_doubtful])
        asked = np.where(is_doubtful, SOLVED * self.judged, enough)
        fields = q, residual, valid
        self._accept(targets, asked, fields)
        for block in _blocks(tried & ~valid.any(-1, keepdims=True)):
            places = _at(block, _missed(block, valid))
            if len(places[-1]):
                of_target = (_of_slots(array, places) for array in (targets, asked, aside))
                self._refine(places, fields, *of_target)
        if is_doubtful.any():
            self._accept(targets, enough, fields)

    def _accept(self, targets: FloatArray, enough: FloatArray, fields: _Fields) -> None:
        """Mark solution slots with a residual of at most ``enough`` as valid.

        If one slot of a pose solves the exact target, slots that solve the target only
        approximately are not valid.

        Before this test, Newton's method refines the solutions of a rounded target pose.
        """
        q, residual, valid = fields
        solved = SOLVED * self.judged
        missed = ~valid.any(-1, keepdims=True)
        is_near = residual <= _GROWTH * enough[..., None]
        for block in _blocks((enough > solved)[..., None] & is_near & missed):
            target = self._rigid(_of_slots(targets, block))
            found, left = self.newton(target, q[block], _ROUNDED_STEPS)
            better = left < residual[block]
            slots = _at(block, better)
            q[slots], residual[slots] = found[better], left[better]
        is_exact = (residual <= solved).any(-1)
        limit = np.where(is_exact, solved, enough)
        valid |= missed & (residual <= limit[..., None])

    def _is_aside(
        self, targets: FloatArray, q: FloatArray, residual: FloatArray, missed: BoolArray
    ) -> BoolArray:
        """Test which of the poses (...,) are reachable although no solution was found.

        Only poses with a rounded translation and axes parallel to the base axes are tested.
        """
        found = np.zeros(missed.shape, dtype=bool)
        if self.task.components or not missed.any():
            return found
        found[missed] = self._is_at_right_angles(targets[missed])
        found[found] = rounded_residuals(targets[found]) > 0
        found &= np.isfinite(residual).any(-1)
        if not found.any():
            return found
        slot = np.where(np.isfinite(residual[found]), residual[found], np.inf).argmin(-1)
        nearest = q[found][np.arange(len(slot)), slot]
        rows, error = self._measured(targets[found], nearest)
        U, sizes, _ = np.linalg.svd(rows[..., self._free(q.shape[-1])])
        lost = (U.mT @ error[..., None])[..., 0]
        lost[:, : sizes.shape[-1]][sizes > AT_REST_RATE] = 0.0
        is_twice = (sizes <= AT_REST_RATE).sum(-1) > 1
        found[found] = is_twice | ((lost**2).sum(-1) < _ASIDE * (error**2).sum(-1))
        return found

    def _is_at_right_angles(self, poses: FloatArray) -> BoolArray:
        R = poses[..., :3, :3]
        return np.asarray((np.abs(R - np.rint(R)) <= RIGID_TO_ROUNDING).all((-2, -1)))

    def enough(self, target: FloatArray) -> FloatArray:
        """Return maximum residuals (N,) of solutions, for targets (N, ...) before projection."""
        solved = np.full(len(target), SOLVED * self.judged)
        if self.task.components:
            return solved
        return np.asarray(np.maximum(solved, self.judged * rounded_residuals(target)))

    def _rigid(self, target: FloatArray) -> FloatArray:
        return target if self.task.components else project(target, caller="refinement")

    def _refine(
        self,
        slots: tuple[IntArray, ...],
        fields: _Fields,
        target: FloatArray,
        enough: FloatArray,
        aside: BoolArray,
    ) -> None:
        """Refine N slots for targets (N, ...) in place, to residuals of at most ``enough`` (N,).

        If a slot remains unsolved and its residual is near a minimum, a search fixes one joint at a
        time at several values. Where ``aside`` (N,) is True, slots with a large residual are
        searched, too.
        """
        target, (q, _, valid) = self._rigid(target), fields
        found, left = self._tried(target, q[slots], slots, fields, enough)
        missed = np.flatnonzero(_missed(slots, valid))
        starts = descent_starts(
            partial(self._gradients, target[missed]), found[missed], self._free(q.shape[-1])
        )
        row = missed[starts.row]
        self._tried(target[row], starts.q, _at(slots, row), fields, enough[row])
        rests = _missed(slots, valid) & (aside | (left <= AT_REST * self.judged))
        if self.is_determined and rests.any():
            best = _best_of_each(slots, np.where(rests, left, np.inf))
            turning = self.turning(target[best], found[best])
            self._turn(target[best], found[best], turning, _at(slots, best), fields, enough[best])

    def _tried(
        self,
        target: FloatArray,
        q: FloatArray,
        slots: tuple[IntArray, ...],
        fields: _Fields,
        enough: FloatArray,
    ) -> tuple[FloatArray, FloatArray]:
        found, left = self.newton(target, q, _SEARCH if self.searches else STEPS)
        self._take(slots, found, left, fields, enough)
        if self.searches:
            near = np.flatnonzero(_missed(slots, fields[2]) & (left <= REFINED * self.judged))
            found[near], left[near] = self.newton(target[near], found[near])
            self._take(_at(slots, near), found[near], left[near], fields, enough[near])
        return found, left

    def _gradients(
        self, target: FloatArray, row: IntArray, q: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        rows, error = self._measured(target[row], q)
        return (error * error).sum(-1) / 2, -(rows.mT @ error[..., None])[..., 0]

    def _free(self, n: int) -> list[int]:
        return [k for k in range(n) if k not in self.fixed]

    def turning(self, target: FloatArray, q: FloatArray) -> BoolArray:
        """Return a mask (N, n) of joints to fix along a possible self-motion from q (N, n).

        In a self-motion, the joint with the largest component in the null direction is fixed.
        """
        free = self._free(q.shape[-1])
        rows, error = self._measured(target, q)
        U, sizes, V = np.linalg.svd(rows[..., free])
        rank = (sizes > AT_REST_RATE).sum(-1)
        step = np.zeros_like(q)
        step[:, free] = BEND_STEP * V[:, -1]
        ahead, behind = (self._measured(target, q + sign * step)[1] for sign in (1, -1))
        bend = (U.mT @ (ahead + behind - 2 * error)[..., None])[..., 0] / BEND_STEP**2
        bend[np.arange(U.shape[-1]) < rank[:, None]] = 0.0
        directions = len(free) - rank
        straight = np.abs(bend).max(-1) < AT_REST_BEND
        turning = np.zeros(q.shape, dtype=bool)
        turning[:, free] = (directions > 1)[:, None]
        along = np.flatnonzero((directions == 1) & straight)
        turning[along, np.abs(step[along]).argmax(-1)] = True
        return turning

    def _measured(self, target: FloatArray, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        wanted = target if self.unit == 1 else self.task.divided(target, self.unit)
        rows, error, _ = self.task(*self._in_unit(q), wanted)
        return rows, error

    def _turn(
        self,
        target: FloatArray,
        q: FloatArray,
        turning: BoolArray,
        slots: tuple[IntArray, ...],
        fields: _Fields,
        enough: FloatArray,
    ) -> None:
        """Refine q (N, n) for targets (N, ...) with one joint fixed at a time.

        Each joint that is True in the mask ``turning`` (N, n) is fixed at several angles, evenly
        spaced over a full turn. If the joint were free, a self-motion would dominate each step
        without reducing the error.
        """
        values = np.arange(_VALUES) * (2 * np.pi / _VALUES)
        for joint in np.flatnonzero(turning.any(0)).tolist():
            open_ = np.flatnonzero(_missed(slots, fields[2]) & turning[:, joint])
            row = np.repeat(open_, _VALUES)
            start = q[row]
            start[:, joint] += np.tile(values, len(open_))
            constrained = replace(self, fixed=(*self.fixed, joint))
            found, left = constrained.newton(target[row], start)
            near = left <= AT_REST * self.judged
            row, (found, left) = row[near], self.newton(target[row[near]], found[near])
            self._take(_at(slots, row), found, left, fields, enough[row])

    def _take(
        self,
        slots: tuple[IntArray, ...],
        found: FloatArray,
        left: FloatArray,
        fields: _Fields,
        enough: FloatArray,
    ) -> None:
        q, residual, valid = fields
        solved = left <= enough
        slots = _at(slots, solved)
        q[slots], residual[slots], valid[slots] = found[solved], left[solved], True

    def newton(
        self, target: FloatArray, q: FloatArray, steps: int = STEPS
    ) -> tuple[FloatArray, FloatArray]:
        """Refine q (N, n) for targets (N, ...). Return coordinates (N, n) and residuals (N,)."""
        found = q.copy()
        wanted = target if self.unit == 1 else self.task.divided(target, self.unit)
        iterate(self._in_unit, self.task, wanted, found, self.fixed, steps)
        return found, self._residual(target, found)

    def _in_unit(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        pose, J = self.fk_jacobian_mixed(q)
        if self.unit != 1:
            pose[..., :3, 3] /= self.unit
            J[..., :3, :] /= self.unit
        return pose, J

    def _residual(self, target: FloatArray, q: FloatArray) -> FloatArray:
        pose, J = self.fk_jacobian_mixed(q)
        if not self.task.components:
            return _residual(pose, target, self.unit)
        return self.task(pose, J, target)[2]


def _at(slots: tuple[IntArray, ...], chosen: BoolArray | IntArray) -> tuple[IntArray, ...]:
    return tuple(index[chosen] for index in slots)


def _blocks(chosen: BoolArray) -> Iterator[tuple[IntArray, ...]]:
    slots = np.nonzero(chosen)
    for first in range(0, len(slots[0]), BLOCK):
        yield tuple(index[first : first + BLOCK] for index in slots)


def _of_slots(array: NDArray[Any], slots: tuple[IntArray, ...]) -> NDArray[Any]:
    rest = array.shape[len(slots) - 1 :]
    return np.broadcast_to(array[slots[:-1]], (len(slots[-1]), *rest))


def _best_of_each(slots: tuple[IntArray, ...], left: FloatArray) -> IntArray:
    rows = np.flatnonzero(np.isfinite(left))
    rows = rows[np.argsort(left[rows], kind="stable")]
    if len(slots) == 1:
        return rows[:1]
    targets = np.stack([index[rows] for index in slots[:-1]], -1)
    return rows[np.unique(targets, axis=0, return_index=True)[1]]


def _missed(slots: tuple[IntArray, ...], valid: BoolArray) -> BoolArray:
    return np.broadcast_to(~np.asarray(valid.any(-1))[slots[:-1]], slots[-1].shape)


def refinement_of(
    manifest: Manifest,
    info: FunctionInfo,
    functions: Mapping[str, Function[Any]],
    unit: float = 1.0,
    judged: float = 1.0,
) -> Refinement | None:
    """Return the refinement for an IK function, or None for a function without refinement."""
    jacobian = manifest.with_role("pose and jacobian", "actuators")
    if not (
        info.role.is_inverse and (info.role.domain == "pose" or info.role.components) and jacobian
    ):
        return None
    return Refinement(
        functions[jacobian.name],
        (*info.role.fixed, *info.role.free),
        unit,
        Task(info.role.components),
        judged,
        info.role.searches,
        len(info.inputs) - 1 <= len(info.role.fixed),
    )


def _residual(here: FloatArray, there: FloatArray, unit: float) -> FloatArray:
    apart = here - there
    distance2 = (apart[..., :3, 3] ** 2).sum(-1)
    turned2 = (apart[..., :3, :3] ** 2).sum((-2, -1))
    return np.asarray(np.sqrt(np.maximum(distance2, turned2 / 2 * unit**2)))


def descent_starts(gradients: Gradients, q: FloatArray, free: list[int]) -> DescentStarts:
    """Return start configurations on both sides of saddles of f = |e|^2 / 2.

    Newton's method stalls at the saddle, because the gradient -J^T e is 0.
    """
    f, g = gradients(np.arange(len(q)), q)
    error = np.sqrt(2 * f)
    row = np.flatnonzero(np.abs(g[:, free]).max(-1) <= SADDLE * error)
    H = _hessian(gradients, row, q[row], free)
    # Near a dead point, loops may not close at the shifted coordinates of the finite differences. H
    # is then not finite.
    closes = np.isfinite(H).all((1, 2))
    row, H = row[closes], H[closes]
    curvatures, directions = np.linalg.eigh(H)
    fall = -curvatures[:, 0] / error[row]
    down = fall > SADDLE_BEND
    row, step = row[down], np.zeros((np.count_nonzero(down), q.shape[1]))
    length = np.minimum(np.sqrt(error[row] / fall[down]), _LONGEST)
    step[:, free] = length[:, None] * directions[down, :, 0]
    return DescentStarts(np.tile(row, 2), np.concatenate([q[row] + step, q[row] - step]))


def _hessian(gradients: Gradients, row: IntArray, q: FloatArray, free: list[int]) -> FloatArray:
    step = SADDLE_STEP * np.eye(q.shape[1])[free]
    around = (q[:, None] + np.concatenate([step, -step])).reshape(-1, q.shape[1])
    g = gradients(np.repeat(row, 2 * len(free)), around)[1][:, free]
    ahead, behind = g.reshape(len(q), 2, len(free), len(free)).swapaxes(0, 1)
    H = (ahead - behind) / (2 * SADDLE_STEP)
    return np.asarray((H + H.mT) / 2)
