"""Paths of poses, followed on one branch of the inverse."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import BoolArray, FloatArray
from ..call.capabilities import needs
from ..contract import FunctionInfo
from ..errors import InputValueError, ShapeError
from ..facts import RobotFacts
from ..fixed import fixed_values, is_own, parameter_values
from ..se3 import project
from ..size import within
from ..tolerances import JUMP
from .aims import Task, TaskName, inverse_for, inverses_of
from .nearest_solution import NearestSolution
from .refinement import Refinement
from .self_motion import NearestRedundancy, check_redundancy
from .slot_facts import facts_of
from .solutions import Solutions

Reason = Literal["", "no solution", "jump", "limit"]
_TURN = 2 * math.pi
_BLOCK = 8
"""Poses that are followed at once after a change of the slot; twice as many after each success."""


@dataclass(frozen=True, slots=True)
class JointPath:
    """The coordinates along a path of poses, as far as it was followed on one branch.

    Attributes:
        q: (reached, n) coordinates [rad or m]; turning joints continue beyond a turn without a
            jump.
        complete: Whether the last pose was reached.
        ended_at: The index of the first pose that was not reached, the number of poses if all were.
        reason: "" if complete; "no solution": no branch reaches that pose; "jump": branches reach
            it, but the nearest is further than a joint may move; "limit": the branch continues
            beyond a limit.
        coordinate: The coordinate that would jump or pass its limit, "" for other reasons.
        next_value: The value that this coordinate would take, NaN for other reasons.
        min_margin: The smallest margin on the path, 0 at the border of reach (a stretched elbow,
            not a wrist in line); NaN if no pose was reached.
        min_margin_index: The index of that pose, -1 if no pose was reached.
        max_step: (n,) the largest move of each coordinate between successive poses.
    """

    q: FloatArray
    complete: bool
    ended_at: int
    reason: Reason
    coordinate: str
    next_value: float
    min_margin: float
    min_margin_index: int
    max_step: FloatArray

    def __str__(self) -> str:
        """In a sentence."""
        if self.complete:
            return f"all {len(self.q)} poses on one branch, margin {self.min_margin:.3g}"
        why = {
            "no solution": "no branch reaches it",
            "jump": f"{self.coordinate} would jump to {self.next_value:.4g}",
            "limit": f"{self.coordinate} would go to {self.next_value:.4g}, beyond its limit",
        }
        return f"ended at pose {self.ended_at}: {why[self.reason]}"


@dataclass(frozen=True, slots=True)
class _Step:
    """The coordinates of a pose on the branch and their slot, or the reason why it has none."""

    q: FloatArray
    margin: float
    reason: Reason = ""
    joint: int = 0
    slot: int | None = None


def has_inverse(robot: RobotFacts) -> bool:
    """Whether a robot has an inverse of poses or of parts of a pose."""
    return bool(inverses_of(robot.manifest))


class InverseMethods(RobotFacts):
    """The methods of a robot with a closed-form inverse."""

    _best_step: Callable[..., NearestSolution]

    @needs(when=has_inverse)
    def ik_path(
        self,
        T: ArrayLike,
        q_seed: ArrayLike,
        *,
        task: TaskName = "pose",
        fixed: Any = None,
        redundancy: NearestRedundancy = "fixed",
        max_step: float | None = None,
    ) -> JointPath:
        """Follows one branch along a path of poses, from the solution nearest to `q_seed`.

        Each step takes the solution that moves the joints least from the pose before, turns
        included. So the path follows the branch itself rather than its slot: at a singularity
        branches meet and slots may be exchanged. Where a continuum of solutions reaches a pose (a
        wrist with two axes in line), Newton's iteration finds the solution nearby. A path ends
        where it would have to leave the robot's limits, even if another branch would continue.

        Arms of fewer axes follow the part of the poses that they can reach, such as a position and
        the elevation of the tool's axis along a straight line: `task` names one of the robot's
        inverses `ik_position`, `ik_position_pitch`, `ik_position_direction` and `ik_planar`. A
        joint that the task leaves free is 0, as there.

        Args:
            T: (m, 4, 4) poses of the tool measured and expressed in the base frame, close to each
                other; the nearest rigid pose is taken where one is off by at most
                `se3.NEARLY_RIGID`. For a part of a pose also (m, k), the input of that inverse.
            q_seed: (n,) coordinates [rad or m] near the start: the path begins at the nearest
                solution within the limits.
            task: The part of each pose that counts: "pose", "position", "position_pitch" (the
                elevation of the tool's third axis above the base's x-y plane),
                "position_direction" (of the third axis) or "planar" (x, y and the angle of the
                first axis in that plane).
            fixed: Joints that keep their values along the path: names or indices keep the values
                at `q_seed`, a mapping sets values () or (m,). The parameters of a redundant robot
                (`redundancy`) keep their values at `q_seed` unless they are named. Other joints
                need an inverse that is derived on first use.
            redundancy: How a redundant robot uses its surplus freedom, as in `ik_nearest`. "fixed"
                keeps its parameters. Other values choose the parameters anew at each pose, among
                the solutions within `max_step` of the previous configuration.
            max_step: Largest move of a joint between successive poses [rad or m]; None: 0.5 rad,
                for prismatic joints 0.5 `unit_length`.

        Returns:
            The coordinates as far as the path was followed, and the reason for its end.

        Raises:
            ShapeError: If T is not a list of poses, or `q_seed` not n values.
            InputValueError: If the robot has no inverse for that part of a pose, if `max_step` is
                not positive, or a pose not nearly rigid, with the reason.
            DerivationError: If fixed joints leave no closed form.
        """
        label = f"{self.name}.ik_path"
        check_redundancy(label, redundancy)
        info = inverse_for(self.manifest, "ik_path", task)
        inverse, part = self.functions[info.name], Task(info.role.aims)
        poses, start = np.asarray(T, np.float64), np.asarray(q_seed, np.float64)
        is_part = bool(part.aims) and poses.ndim == 2 and poses.shape[1:] == part.shape  # noqa: PLR2004
        if start.shape != (self.n,) or not (is_part or poses.ndim == 3):  # noqa: PLR2004
            also = f" or (m, {part.shape[0]})" if part.aims else ""
            raise ShapeError(
                f"{label}: expected T (m, 4, 4){also} and q_seed ({self.n},), got shapes "
                f"{poses.shape} and {start.shape}"
            )
        if max_step is not None and not max_step > 0:
            raise InputValueError(f"{label}: max_step must be positive, got {max_step!r}")
        # The inverse of a whole pose takes poses as they come, and allows for their rounding.
        rigid = poses if is_part else project(poses, caller=label)
        target = poses if is_part or not part.aims else part.of(rigid)
        seeds = np.broadcast_to(start, (len(poses), self.n))
        values: Any = fixed_values(self, label, task, fixed, seeds)
        free = {item.name for item in self.redundancy} - {*values}
        if redundancy != "fixed" and len(info.inputs) > 1 and free:
            return self._best_path(label, info, target, start, values, redundancy, max_step)
        if is_own(self, values) and len(info.inputs) > 1:
            values = parameter_values(self, values, seeds)
        solutions = inverse(target, fixed=values) if values else inverse(target)
        largest = self._largest(max_step, type(solutions))
        if not len(poses):
            return self._report(np.empty((0, self.n)), np.empty(0), None)
        q, margin = np.empty((len(poses), self.n)), np.empty(len(poses))
        index, block, step = 0, _BLOCK, self._first(solutions.at(0), start)
        while not step.reason:
            q[index], margin[index], index = step.q, step.margin, index + 1
            if step.slot is not None:
                end = min(index + block, len(poses))
                kept = self._kept(solutions, index, end, step.slot, step.q, largest)
                stays = slice(index, index + len(kept))
                q[stays], margin[stays] = kept, solutions.margin[stays, step.slot]
                block, index = 2 * block if stays.stop == end else _BLOCK, stays.stop
            if index == len(poses):
                return self._report(q, margin, None)
            whole = poses[index] if task == "pose" else None
            step = self._next(solutions.at(index), whole, q[index - 1], largest)
        return self._report(q[:index], margin[:index], step)

    def _best_path(
        self,
        label: str,
        info: FunctionInfo,
        target: FloatArray,
        start: FloatArray,
        values: Mapping[str, FloatArray],
        redundancy: NearestRedundancy,
        max_step: float | None,
    ) -> JointPath:
        """A path whose redundancy parameters are chosen anew at each pose."""
        largest = self._largest(max_step, self.functions[info.name].solutions)
        q, margin = np.empty((len(target), self.n)), np.empty(len(target))
        for k, pose in enumerate(target):
            here, near = (q[k - 1], largest) if k else (start, np.full(self.n, np.inf))
            held = {name: value[k : k + 1] for name, value in values.items()}
            found = self._best_step(label, info, pose, here, held, redundancy, near)
            step = None if found.valid else _Step(here, np.nan, "no solution")
            if found.reason == "limits":
                found = self._best_step(label, info, pose, here, held, "fixed", limits=None)
                beyond = np.maximum(self.lower - found.q, found.q - self.upper)
                step = _Step(found.q, np.nan, "limit", int(np.argmax(beyond)))
            elif (np.abs(found.q - here) > near).any():
                step = _Step(found.q, np.nan, "jump", int(np.argmax(np.abs(found.q - here) / near)))
            if step:
                return self._report(q[:k], margin[:k], step)
            q[k], margin[k] = found.q, found.margin
        return self._report(q, margin, None)

    def _largest(self, max_step: float | None, kind: Any) -> FloatArray:
        """(n,) largest moves of the joints between successive poses."""
        return JUMP * facts_of(kind).units if max_step is None else np.full(self.n, float(max_step))

    def _first(self, slots: Solutions, q_seed: FloatArray) -> _Step:
        if not slots.valid.any():
            return _Step(q_seed, np.nan, "no solution")
        inside = slots.within_limits()
        allowed = inside if inside.valid.any() else slots
        moves = allowed.distances_from(q_seed)
        best = _least(moves / facts_of(type(slots)).units, allowed.valid)
        q, margin = q_seed + moves[best], float(allowed.margin[best])
        if allowed is inside:
            # The slots of `inside` list turns separately: the path starts in none of `slots`.
            return _Step(q, margin)
        outside = ~within(q, self.lower, self.upper, facts_of(type(slots)).units)
        return _Step(q, margin, "limit", int(np.argmax(outside)))

    def _next(
        self, slots: Solutions, pose: FloatArray | None, here: FloatArray, max_step: FloatArray
    ) -> _Step:
        if not slots.valid.any():
            return _Step(here, np.nan, "no solution")
        moves = slots.distances_from(here)
        best = _least(moves / facts_of(type(slots)).units, slots.valid)
        move, margin = moves[best], float(slots.margin[best])
        if (np.abs(move) > max_step).any():
            nearby = self._nearby(pose, here, slots.unit_length)
            if nearby is None or (np.abs(nearby - here) > max_step).any():
                return _Step(here + move, margin, "jump", int(np.argmax(np.abs(move) / max_step)))
            return self._inside(nearby, slots, margin, None)
        return self._inside(here + move, slots, margin, best)

    def _inside(self, q: FloatArray, slots: Solutions, margin: float, slot: int | None) -> _Step:
        """A step to coordinates, or the reason that they are beyond a limit."""
        outside = ~within(q, self.lower, self.upper, facts_of(type(slots)).units)
        if outside.any():
            return _Step(q, margin, "limit", int(np.argmax(outside)))
        return _Step(q, margin, slot=slot)

    def _kept(
        self,
        solutions: Solutions,
        first: int,
        end: int,
        slot: int,
        here: FloatArray,
        max_step: FloatArray,
    ) -> FloatArray:
        """(k, n) coordinates at the poses from `first` on at which the path stays in a slot.

        They are those of `_next`, for all poses at once: the slot moves the joints least, none of
        them jumps, and limits hold.
        """
        units, own = facts_of(type(solutions)).units, solutions.q[first - 1 : end, slot]
        part = slice(first, end)
        slots = type(solutions)._make(field[part] for field in solutions)
        moves = slots.distances_from(own[:-1])
        with np.errstate(invalid="ignore"):
            best = np.where(slots.valid, np.abs(moves / units).max(-1), np.inf).argmin(-1)
            # Whole turns from one pose to the next, so that rounding does not add up.
            turns = np.cumsum(moves[:, slot] - np.diff(own, axis=0), axis=0)
            turns = _TURN * np.round((turns + here - own[0]) / _TURN)
            q = own[1:] + np.where(solutions.wraps, turns, 0.0)
            stays = (best == slot) & slots.valid[:, slot]
            stays &= (np.abs(moves[:, slot]) <= max_step).all(-1)
            stays &= within(q, self.lower, self.upper, units).all(-1)
        return q[: len(q) if stays.all() else int(np.argmin(stays))]

    def _nearby(self, pose: FloatArray | None, here: FloatArray, unit: float) -> FloatArray | None:
        """The solution near the last one, where the pose alone determines solutions."""
        if (
            pose is None
            or ("pose and jacobian", "actuators", "") not in self._roles
            or self.redundancy
        ):
            return None
        refinement = Refinement(self.fk_jacobian_mixed, (), unit, judged=unit)
        rigid = project(pose[None], caller=f"{self.name}.ik_path")
        (q,), (residual,) = refinement.led(rigid, here[None])
        return q if residual <= refinement.enough(pose[None])[0] else None

    def _report(self, q: FloatArray, margins: FloatArray, end: _Step | None) -> JointPath:
        least = int(np.argmin(margins)) if len(q) else -1
        blamed = end is not None and end.reason != "no solution"
        return JointPath(
            q=q,
            complete=end is None,
            ended_at=len(q),
            reason=end.reason if end else "",
            coordinate=self.coordinates[end.joint].name if end and blamed else "",
            next_value=float(end.q[end.joint]) if end and blamed else np.nan,
            min_margin=float(margins[least]) if len(q) else np.nan,
            min_margin_index=least,
            max_step=np.abs(np.diff(q, axis=0)).max(0, initial=0.0),
        )


def _least(moves: FloatArray, valid: BoolArray) -> int:
    """The valid slot with the smallest largest move."""
    return int(np.argmin(np.where(valid, np.abs(moves).max(-1), np.inf)))
