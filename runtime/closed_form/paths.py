"""Paths of poses on one branch of the inverse kinematics function."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import BoolArray, FloatArray, real_array
from ..call.capabilities import needs
from ..contract import FunctionInfo, TaskName
from ..errors import InputTypeError, InputValueError, ShapeError
from ..facts import RobotFacts
from ..fixed import fixed_values, is_own, parameter_values
from ..se3 import project
from ..size import within
from ..tolerances import JUMP
from .fixed_joints import derived_inverse
from .nearest_solution import NearestSolution
from .refinement import Refinement
from .self_motion import NearestRedundancy, check_redundancy
from .slot_facts import facts_of, moved_inside
from .solutions import Solutions
from .task_components import Task, inverse_for

Reason = Literal["", "no solution", "jump", "limit"]
_TURN, _FREE = 2 * math.pi, 3
_BLOCK = 8
"""Number of poses in the first block. If one solution slot has a path through all poses of a block,
the number of poses doubles for the next block."""


@dataclass(frozen=True, slots=True)
class JointPath:
    """Coordinates along a path of poses. The path may end early.

    Attributes:
        q: (reached, n) coordinates [rad or m]. Revolute joints are continuous beyond 2 pi.
        complete: Whether the last pose was reached.
        ended_at: The index of the first pose that was not reached. For a complete path, the number
            of poses.
        reason: Why the path ended. "" if complete; "no solution" if no branch reaches the next
            pose; "jump" if every solution needs a larger joint displacement than allowed; "limit"
            if the branch continues beyond a limit.
        coordinate: The coordinate that jumps or exceeds a limit, otherwise "". For a coupled arm,
            `coordinate` may be the name of a joint.
        next_value: Value that `coordinate` would need for the next pose, or NaN if complete.
        min_margin: The smallest margin on the path. NaN if no pose was reached. The margin is 0 at
            a stretched elbow, but not at aligned wrist axes.
        min_margin_index: The index of the pose with the smallest margin. -1 if no pose was reached.
        max_step: (n,) the largest displacement of each coordinate between successive poses.
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
    q: FloatArray
    margin: float
    reason: Reason = ""
    joint: int = 0
    slot: int | None = None


def has_inverse(robot: RobotFacts) -> bool:
    """Test whether a robot has an IK function for poses or for components of poses."""
    return bool(robot.manifest.inverses)


class InverseMethods(RobotFacts):
    """Methods of robots with an inverse kinematics function."""

    _best_step: Callable[..., NearestSolution]

    @needs("fk", when=lambda robot: not robot.loops and robot.n > _FREE)
    def ik_orientation(self, R: ArrayLike, *, fixed: Mapping[str, ArrayLike]) -> Solutions:
        """Return all values of three revolute joints for which the tool has a given orientation.

        The other revolute joints are fixed. The first call for each set of fixed joints derives an
        inverse kinematics function, which takes seconds.

        Args:
            R: (..., 3, 3) rotation matrices of the tool in the base frame.
            fixed: Values (...) [rad or m] of all revolute joints except three, keyed by joint name;
                `{}` for a robot with three. Prismatic joints are 0 unless `fixed` contains them.

        Returns:
            All coordinates of each solution, with validity, residual and margin.

        Raises:
            InputTypeError: If `fixed` is not a mapping.
            InputValueError: If a name is unknown, or `fixed` does not leave three revolute joints.
            DerivationError: If consecutive free axes are parallel, or if the robot has a mimic
                joint or a helical joint.
        """
        label = f"{self.name}.ik_orientation"
        if not isinstance(fixed, Mapping):
            raise InputTypeError(f"{label}: fixed must map joint names to values, got {fixed!r}")
        if unknown := fixed.keys() - {*self.coordinate_names}:
            raise InputValueError(f"{label}: cannot fix unknown joint {min(unknown)!r}")
        free = [c.name for c in self.coordinates if c.unit == "rad" and c.name not in fixed]
        if len(free) != _FREE:
            raise InputValueError(f"{label}: expected 3 free revolute joints, got {free}")
        names = tuple(name for name in self.coordinate_names if name in fixed)
        solve = derived_inverse(self.manifest, type(self), names, "ik_orientation")
        return solve(R, *(fixed[name] for name in names))

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
        """Follow one branch along a path of poses, from the solution nearest to `q_seed`.

        Each step selects the solution nearest to the previous configuration. Angles that differ by
        full turns count as different solutions. If two aligned wrist axes allow infinitely many
        solutions, Newton's method finds a solution nearby. At a singularity, the solution slot of
        the followed branch may change. The path ends at a joint limit, even if another branch would
        continue.

        Args:
            T: (m, 4, 4) closely spaced poses of the tool in the base frame. Deviations from rigid
                transformations of up to `se3.NEARLY_RIGID` are corrected. For a partial `task`, T
                can also be the input (m, k) of the function `ik_<task>`, for example (m, 3) for
                `ik_position`.
            q_seed: (n,) coordinates [rad or m]. The path starts at the solution nearest to them,
                within the limits.
            task: The part of each pose that the tool must reach, for arms with fewer than six
                joints. Joint coordinates that the task does not determine are 0. "pose" is the
                whole pose. "position" is the origin of the tool frame. "position_pitch" includes
                the origin of the tool frame and the elevation of the tool's z axis above the x-y
                plane of the base. "position_direction" includes the origin of the tool frame and
                the direction of the tool's z axis. "planar" includes x, y, and the angle of the
                tool's x axis in the x-y plane of the base.
            fixed: Joints with prescribed values (only with `task="pose"`): names or indices of
                joints that keep their values at `q_seed`, or a mapping from joint names to one
                value or (m,) values. For joints that are not in `robot.redundancy`, the first call
                takes some seconds, because it derives an inverse kinematics function.
            redundancy: How to select the parameters in `robot.redundancy` of a redundant robot.
                "fixed" keeps their values at `q_seed`. "nearest", "limits" and "manipulability"
                select new values at each pose, with the objectives of `ik_nearest`. The selection
                is limited to solutions within `max_step` of the previous configuration.
            max_step: Maximum displacement of each joint between successive poses [rad or m]. By
                default, 0.5 rad (revolute joints) or 0.5 `robot.unit_length` (prismatic joints).

        Returns:
            The coordinates up to the last reached pose, and the reason if the path ended early.

        Raises:
            ShapeError: If the shape of T or `q_seed` is wrong.
            InputValueError: If the robot has no inverse kinematics function for `task`, if
                `max_step` is not positive, or if a matrix of T is not nearly rigid.
            DerivationError: If the robot has no inverse kinematics function for the fixed joints.
        """
        label = f"{self.name}.ik_path"
        check_redundancy(label, redundancy)
        if max_step is not None and not max_step > 0:
            raise InputValueError(f"{label}: max_step must be positive, got {max_step!r}")
        info = inverse_for(self.manifest, "ik_path", task)
        poses, start = real_array(label, "T", T), real_array(label, "q_seed", q_seed)
        target = self._target(label, Task(info.role.components), poses, start)
        seeds = np.broadcast_to(start, (len(poses), self.n))
        values: Any = fixed_values(self, label, task, fixed, seeds)
        free = {item.name for item in self.redundancy} - {*values}
        if redundancy != "fixed" and len(info.inputs) > 1 and free:
            return self._best_path(label, info, target, start, values, redundancy, max_step)
        if is_own(self, values) and len(info.inputs) > 1:
            values = parameter_values(self, values, seeds)
        inverse = self.functions[info.name]
        solutions = inverse(target, fixed=values) if values else inverse(target)
        largest = self._largest(max_step, type(solutions))
        return self._followed(solutions, poses if task == "pose" else None, start, largest)

    def _target(self, label: str, part: Task, poses: FloatArray, start: FloatArray) -> FloatArray:
        is_part = bool(part.components) and poses.shape[1:] == part.shape
        if start.shape != (self.n,) or not (is_part or poses.ndim == 3):  # noqa: PLR2004
            also = f" or (m, {str(part.shape)[1:-1].rstrip(',')})" if part.components else ""
            raise ShapeError(
                f"{label}: expected T (m, 4, 4){also} and q_seed ({self.n},), got shapes "
                f"{poses.shape} and {start.shape}"
            )
        # If the task is a complete pose, the inverse kinematics function itself projects rounded
        # poses to rigid poses.
        rigid = poses if is_part else project(poses, caller=label)
        return part.of(rigid) if part.components and not is_part else poses

    def _followed(
        self,
        solutions: Solutions,
        poses: FloatArray | None,
        start: FloatArray,
        max_step: FloatArray,
    ) -> JointPath:
        count = len(solutions.q)
        q, margin = np.empty((count, self.n)), np.empty(count)
        if not count:
            return self._report(q, margin, None)
        index, block, step = 0, _BLOCK, self._first(solutions.at(0), start)
        while not step.reason:
            q[index], margin[index], index = step.q, step.margin, index + 1
            if step.slot is not None:
                end = min(index + block, count)
                kept = self._kept(solutions, index, end, step.slot, step.q, max_step)
                stays = slice(index, index + len(kept))
                q[stays], margin[stays] = kept, solutions.margin[stays, step.slot]
                block, index = 2 * block if stays.stop == end else _BLOCK, stays.stop
            if index == count:
                return self._report(q, margin, None)
            whole = None if poses is None else poses[index]
            step = self._next(solutions.at(index), whole, q[index - 1], max_step)
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
        largest = self._largest(max_step, self.functions[info.name].solutions)
        q, margin = np.empty((len(target), self.n)), np.empty(len(target))
        for k, pose in enumerate(target):
            here, near = (q[k - 1], largest) if k else (start, np.full(self.n, np.inf))
            fixed_q = {name: value[k : k + 1] for name, value in values.items()}
            found = self._best_step(label, info, pose, here, fixed_q, redundancy, near)
            step = None if found.valid else _Step(here, np.nan, "no solution")
            if found.reason == "limits":
                found = self._best_step(label, info, pose, here, fixed_q, "fixed", limits=None)
                step = self._beyond(found.q, self.functions[info.name].solutions)
            elif (np.abs(found.q - here) > near).any():
                step = _Step(found.q, np.nan, "jump", int(np.argmax(np.abs(found.q - here) / near)))
            if step:
                return self._report(q[:k], margin[:k], step)
            q[k], margin[k] = found.q, found.margin
        return self._report(q, margin, None)

    def _largest(self, max_step: float | None, kind: Any) -> FloatArray:
        return JUMP * facts_of(kind).units if max_step is None else np.full(self.n, float(max_step))

    def _first(self, slots: Solutions, q_seed: FloatArray) -> _Step:
        if not slots.valid.any():
            return _Step(q_seed, np.nan, "no solution")
        inside = slots.within_limits()
        allowed = inside if inside.valid.any() else slots
        moves, joints = allowed.distances_from(q_seed), slots.joint_limits
        if allowed is inside and joints is not None:
            ends = self.lower, self.upper
            q, _ = moved_inside(joints, inside.q, inside.valid, q_seed, ends, type(slots))
            moves = q - q_seed
        best = _least(moves / facts_of(type(slots)).units, allowed.valid)
        q = q_seed + moves[best]
        # `best` is an index into `allowed`. In `inside`, solutions that differ by full turns have
        # separate slots.
        step = _Step(q, float(allowed.margin[best]))
        return step if allowed is inside else self._beyond(q, type(slots))

    def _next(
        self, slots: Solutions, pose: FloatArray | None, here: FloatArray, max_step: FloatArray
    ) -> _Step:
        if not slots.valid.any():
            return _Step(here, np.nan, "no solution")
        moves = slots.distances_from(here)
        best = _least(moves / facts_of(type(slots)).units, slots.valid)
        move, margin, nearby = moves[best], float(slots.margin[best]), None
        if (np.abs(move) > max_step).any():
            nearby = self._nearby(pose, here, slots.unit_length)
            if nearby is None or (np.abs(nearby - here) > max_step).any():
                return _Step(here + move, margin, "jump", int(np.argmax(np.abs(move) / max_step)))
        q, slot = (here + move, best) if nearby is None else (nearby, None)
        inside = self._inside(q, type(slots)).all()
        return _Step(q, margin, slot=slot) if inside else self._beyond(q, type(slots))

    def _inside(self, q: FloatArray, kind: Any) -> BoolArray:
        inside, joints = within(q, self.lower, self.upper, facts_of(kind).units), kind.joint_limits
        return inside if joints is None else np.concatenate([inside, joints.inside(q)], -1)

    def _beyond(self, q: FloatArray, kind: Any) -> _Step:
        values = q if kind.joint_limits is None else np.append(q, kind.joint_limits.values(q))
        return _Step(values, np.nan, "limit", int(np.argmin(self._inside(q, kind))))

    def _kept(
        self,
        solutions: Solutions,
        first: int,
        end: int,
        slot: int,
        here: FloatArray,
        max_step: FloatArray,
    ) -> FloatArray:
        units, own = facts_of(type(solutions)).units, solutions.q[first - 1 : end, slot]
        part = slice(first, end)
        slots = type(solutions)._make(field[part] for field in solutions)
        moves = slots.distances_from(own[:-1])
        with np.errstate(invalid="ignore"):
            best = np.where(slots.valid, np.abs(moves / units).max(-1), np.inf).argmin(-1)
            # Only whole turns are added to the solutions, so that rounding errors do not accumulate
            # along the path.
            turns = np.cumsum(moves[:, slot] - np.diff(own, axis=0), axis=0)
            turns = _TURN * np.round((turns + here - own[0]) / _TURN)
            q = own[1:] + np.where(solutions.wraps, turns, 0.0)
            stays = (best == slot) & slots.valid[:, slot]
            stays &= (np.abs(moves[:, slot]) <= max_step).all(-1)
            stays &= self._inside(q, type(solutions)).all(-1)
        return q[: len(q) if stays.all() else int(np.argmin(stays))]

    def _nearby(self, pose: FloatArray | None, here: FloatArray, unit: float) -> FloatArray | None:
        has_jacobian = ("pose and jacobian", "actuators", "") in self._roles
        if pose is None or not has_jacobian or self.redundancy:
            return None
        refinement = Refinement(self.fk_jacobian_mixed, (), unit, judged=unit)
        rigid = project(pose[None], caller=f"{self.name}.ik_path")
        (q,), (residual,) = refinement.newton(rigid, here[None])
        return q if residual <= refinement.enough(pose[None])[0] else None

    def _report(self, q: FloatArray, margins: FloatArray, end: _Step | None) -> JointPath:
        least = int(np.argmin(margins)) if len(q) else -1
        blamed = end is not None and end.reason != "no solution"
        limited = [self.configuration_variables[v.index].name for v in self.manifest.loops.limited]
        names = (*self.coordinate_names, *(limited or self.joint_names))
        return JointPath(
            q=q,
            complete=end is None,
            ended_at=len(q),
            reason=end.reason if end else "",
            coordinate=names[end.joint] if end and blamed else "",
            next_value=float(end.q[end.joint]) if end and blamed else np.nan,
            min_margin=float(margins[least]) if len(q) else np.nan,
            min_margin_index=least,
            max_step=np.abs(np.diff(q, axis=0)).max(0, initial=0.0),
        )


def _least(moves: FloatArray, valid: BoolArray) -> int:
    return int(np.argmin(np.where(valid, np.abs(moves).max(-1), np.inf)))
