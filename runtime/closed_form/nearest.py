"""The inverse kinematics solution that is nearest to a seed, for controllers.

C code handles calls with only poses and seeds (`call/function/nearest.c`). This module handles
options, partial poses, fixed joints, and poses that need refinement.
"""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import FloatArray, real_array
from ..call import threads as splitting
from ..call._call import Function, Nearest, nearest_of_slots, nearest_rows
from ..call.capabilities import needs
from ..contract import FunctionInfo, Redundancy, TaskName
from ..errors import InputTypeError, InputValueError, ShapeError
from ..facts import RobotFacts
from ..fixed import fixed_values, is_own, parameter_values
from ..se3 import project, refuse
from .nearest_solution import Moves, NearestSolution, limited_type, nearest_type
from .paths import has_inverse
from .refinement import Refinement
from .self_motion import NearestRedundancy, Objective, best_parameters, check_redundancy
from .slot_facts import facts_of, read_limits, read_weights
from .solutions import LeastSquares, Solutions
from .task_components import Task, inverse_for

IntArray = NDArray[np.int8]
_POSE = (4, 4)
Rows = tuple[FloatArray, FloatArray, FloatArray, IntArray]
"""Coordinates (N, n), residuals (N,), margins (N,), and solution slots (N,). In a row without a
solution, a negative reason code replaces the solution slot."""


@dataclass(frozen=True, eq=False)
class Chosen:
    """An inverse kinematics function, and the data for the selection of one of its solutions.

    Attributes:
        info: The manifest entry of the inverse function.
        inverse: The inverse.
        moves: The distance metric.
        parameters: The inputs that follow the target in a call of the inverse kinematics function,
            each an array of N values.
        exact: Values (N,) of coordinates that must not change, keyed by index in q.
        threads: The number of threads. The value 0 means one thread per CPU core.
    """

    info: FunctionInfo
    inverse: Function[Solutions]
    moves: Moves
    parameters: tuple[FloatArray, ...]
    exact: Mapping[int, FloatArray]
    threads: int

    def solve(self, target: FloatArray, q_seed: FloatArray) -> Rows:
        """Return the unrefined nearest solutions for targets (N, ...) and seeds (N, n)."""
        n, count = q_seed.shape[-1], len(target)
        found = np.empty((count, n)), np.empty(count), np.empty(count), np.empty(count, np.int8)
        operands = [target, q_seed, *self.parameters]

        def part(target: Any, q_seed: Any, *rest: Any, out: Any) -> None:
            nearest_rows(self.inverse, (target, *rest), q_seed, self.moves.arrays, out)

        cost = self.inverse.operations.get("total", 1)
        splitting.run_rows(part, operands, found, cost, self.threads)
        return found

    def of_slots(self, solutions: Solutions, q_seed: FloatArray) -> Rows:
        """Return the nearest of the valid solution slots (N, k) for seeds (N, n)."""
        n, count = q_seed.shape[-1], len(q_seed)
        found = np.empty((count, n)), np.empty(count), np.empty(count), np.empty(count, np.int8)
        judged = np.where(solutions.valid, 0.0, np.inf)
        judged[np.isnan(solutions.residual)] = np.nan
        slots = tuple(map(np.ascontiguousarray, (solutions.q, judged, solutions.margin)))
        nearest_of_slots(self.inverse, slots, q_seed, self.moves.arrays, found)
        q, residual, margin, slot = found
        closest = np.where(np.isnan(solutions.residual), np.inf, solutions.residual).argmin(-1)
        taken = np.where(slot >= 0, slot, closest)[:, None]
        open_ = np.isnan(residual) & (slot < 0)
        residual[:] = np.take_along_axis(solutions.residual, taken, -1)[:, 0]
        margin[:] = np.take_along_axis(solutions.margin, taken, -1)[:, 0]
        residual[open_] = margin[open_] = np.nan
        return q, residual, margin, slot


class NearestMethods(RobotFacts):
    """Robot methods for one solution near a seed."""

    @needs(when=has_inverse)
    def ik_nearest(
        self,
        T: ArrayLike,
        q_seed: ArrayLike,
        *,
        task: TaskName = "pose",
        fixed: Any = None,
        limits: Any = "robot",
        weights: ArrayLike | None = None,
        redundancy: NearestRedundancy = "fixed",
        out: Any = None,
        threads: int | Literal["all"] = 1,
    ) -> NearestSolution:
        """Return the inverse kinematics solution within the limits that is nearest to `q_seed`.

        The search covers all branches, and all full turns within the limits. The distance is the
        largest weighted displacement of a coordinate from `q_seed`. Displacements of prismatic
        joints are divided by `robot.unit_length`. If two distances differ only by rounding, the
        branch that comes first in `robot.labels` is selected. Poses are solved independently.

        Args:
            T: (..., 4, 4) poses of the tool in the base frame. For a partial `task`, T can also be
                the input of the function `ik_<task>`, for example (..., 3) for `ik_position`. An
                array (..., 4, 4) is read as poses if the last row of every matrix is 0, 0, 0, 1.
            q_seed: (..., n) coordinates [rad or m] near the solution. `q_seed` may exceed limits.
            task: The part of the pose that the tool must reach: "pose" (the whole pose),
                "position", "position_pitch", "position_direction" or "planar"; see `ik_path`.
                Coordinates that the task leaves undetermined are 0.
            fixed: Joints that must not move (only with `task="pose"`): names or indices of joints
                that keep their values at `q_seed`, or a mapping from joint names to values () or
                (...). For joints outside `robot.redundancy`, the first call derives an inverse
                kinematics function in seconds.
            limits: "robot" (the limits of the robot), None for no limits, or (n, 2) lower and upper
                limits [rad or m]. The robot's limits of coupled and passive joints also apply,
                unless `limits` is None. Coordinates that exceed a limit by rounding are clipped.
            weights: (n,) weights of the displacements, 0 to ignore a coordinate; 1 by default.
            redundancy: How to select the parameters in `robot.redundancy` of a redundant robot.
                "fixed" keeps their values at `q_seed`. "nearest" minimizes the distance from
                `q_seed`. "limits" maximizes the smallest distance from a joint limit, relative to
                the joint range. "manipulability" maximizes the measure of `robot.manipulability`.
                For each parameter value, only the solution nearest to `q_seed` is considered.
            out: A tuple of arrays for q, residual, margin and valid; None for new arrays.
            threads: The number of threads for a large batch, or "all" for one thread per core.

        Returns:
            `q (..., n)` [rad or m], `residual` [m], `margin` and `valid`, each `(...,)`. Without a
            solution, `q` is NaN, `valid` is False, and the property `reason` states the cause.

        Raises:
            ShapeError: If a shape is wrong or leading dimensions do not broadcast.
            InputTypeError: If an argument has the wrong type.
            InputValueError: If a value is out of range, the robot has no inverse kinematics
                function for `task`, or a matrix of T is not nearly rigid.
            DerivationError: If the robot has no inverse kinematics function for the fixed joints.
        """
        label = f"{self.name}.ik_nearest"
        check_redundancy(label, redundancy)
        info = inverse_for(self.manifest, "ik_nearest", task)
        target, seeds, batch = self._rows(label, task, info, T, q_seed)
        moves = self._moves(label, info, limits, weights)
        n_threads = splitting.read_threads(label, threads)
        fixed_q = fixed_values(self, label, task, fixed, seeds)
        found, limited = self._best(
            label, info, moves, (target, seeds), fixed_q, redundancy, n_threads
        )
        return _packed(label, self.functions[info.name], found, limited, batch, out)

    @needs("fk_jacobian_mixed")
    def ik_refine(self, T: ArrayLike, q_seed: ArrayLike) -> LeastSquares:
        """Refine an approximate inverse kinematics solution by Newton's method.

        Args:
            T: (..., 4, 4) poses of the tool in the base frame.
            q_seed: (..., n) coordinates near the solution [rad or m]. Joint limits are ignored.

        Returns:
            `q (..., n)` [rad or m] and `residual (...,)` [m] at the last step. The residual is the
            larger of the position error and `2 sin(angle / 2) robot.unit_length`, where `angle` is
            the rotation error. After convergence, the residual is 0 up to rounding.

        Raises:
            ShapeError: If a shape is wrong or leading dimensions do not broadcast.
            InputValueError: If a matrix of T is not nearly rigid.
        """
        label = f"{self.name}.ik_refine"
        target, seeds, batch = self._rows(label, "pose", None, T, q_seed)
        refinement = Refinement(self.fk_jacobian_mixed, (), self.unit_length)
        q, residual = refinement.newton(project(target, caller=label), seeds)
        return LeastSquares(q.reshape(*batch, self.n), residual.reshape(batch)[()])

    def _rows(
        self, label: str, task: TaskName, info: FunctionInfo | None, T: ArrayLike, q_seed: ArrayLike
    ) -> tuple[FloatArray, FloatArray, tuple[int, ...]]:
        given, seeds = real_array(label, "T", T), real_array(label, "q_seed", q_seed)
        core = info.inputs[0].shape if info else _POSE
        is_pose = given.shape[-2:] == _POSE
        if is_pose and task != "pose":
            is_pose = bool((given[..., 3, :] == np.eye(4)[3]).all())
        shape = _POSE if is_pose or task == "pose" else core
        if given.shape[given.ndim - len(shape) :] != shape:
            part = ", ".join(map(str, core))
            own = "" if task == "pose" else f", or (..., {part}) as for ik_{task}"
            raise ShapeError(
                f"{label}: T must have shape (..., 4, 4){own}, got shape {given.shape}"
            )
        if seeds.shape[-1:] != (self.n,):
            raise ShapeError(
                f"{label}: q_seed must have shape (..., {self.n}), got shape {seeds.shape}"
            )
        leading = given.shape[: given.ndim - len(shape)]
        try:
            batch = np.broadcast_shapes(leading, seeds.shape[:-1])
        except ValueError:
            raise ShapeError(
                f"{label}: leading dimensions do not broadcast: {leading} of T and "
                f"{seeds.shape[:-1]} of q_seed"
            ) from None
        targets = np.broadcast_to(given, (*batch, *shape)).reshape(-1, *shape)
        if info and is_pose and task != "pose":
            targets = Task(info.role.components).of(project(targets, caller=label))
        rows = np.broadcast_to(seeds, (*batch, self.n)).reshape(-1, self.n)
        return np.ascontiguousarray(targets), np.ascontiguousarray(rows), batch

    def _moves(
        self, label: str, info: FunctionInfo, limits: Any = "robot", weights: Any = None
    ) -> Moves:
        kind = self.functions[info.name].solutions
        assert kind is not None
        lower, upper = read_limits(self.coordinates, label, limits)
        if kind.joint_limits is not None:
            free = np.full(len(kind.joint_limits.lower), np.inf)
            own = kind.joint_limits
            ends = (-free, free) if limits is None else (own.lower, own.upper)
            lower, upper = np.append(lower, ends[0]), np.append(upper, ends[1])
        scale = 1.0 if weights is None else read_weights(self.n, label, weights)
        facts = facts_of(kind)
        moves = Moves(lower, upper, scale / facts.units, facts.turn)
        return moves.with_fixed(info.role.free)

    def _best(
        self,
        label: str,
        info: FunctionInfo,
        moves: Moves,
        rows: tuple[FloatArray, FloatArray],
        fixed_q: Mapping[str, FloatArray],
        redundancy: NearestRedundancy,
        threads: int,
        max_step: FloatArray | float = np.inf,
    ) -> tuple[Rows, Any]:
        inverse, (target, seeds) = self.functions[info.name], rows
        if fixed_q and not is_own(self, fixed_q):
            if redundancy != "fixed":
                raise InputValueError(
                    f"{label}: the fixed joints leave no redundancy parameter free; "
                    f'expected redundancy="fixed", got {redundancy!r}'
                )
            return self._with_joints_fixed(info, inverse, moves, target, seeds, fixed_q)
        make = partial(self._chosen, info, inverse, moves, threads)
        free = [item.name for item in self._parameters(info) if item.name not in fixed_q]
        if redundancy != "fixed" and free:
            value = self._objective(redundancy, moves)

            def objective(q: FloatArray, q_seed: FloatArray) -> FloatArray:
                is_near = (np.abs(q - q_seed) <= max_step).all(-1)
                return np.where(is_near, value(q, q_seed), -np.inf)

            fixed_q = best_parameters(self, make, objective, rows, fixed_q, free)
        return _settled(make(seeds, fixed_q), target, seeds)

    def _best_step(
        self,
        label: str,
        info: FunctionInfo,
        target: FloatArray,
        q_seed: FloatArray,
        fixed_q: Mapping[str, FloatArray],
        redundancy: NearestRedundancy,
        max_step: FloatArray | float = np.inf,
        limits: Any = "robot",
    ) -> NearestSolution:
        moves, rows = self._moves(label, info, limits), (target[None], q_seed[None])
        found, limited = self._best(label, info, moves, rows, fixed_q, redundancy, 1, max_step)
        return _packed(label, self.functions[info.name], found, limited, (), None)

    def _chosen(
        self,
        info: FunctionInfo,
        inverse: Function[Solutions],
        moves: Moves,
        threads: int,
        seeds: FloatArray,
        fixed_q: Mapping[str, FloatArray],
        *,
        free: bool = False,
    ) -> Chosen:
        own = self._parameters(info)
        parameters = parameter_values(self, fixed_q, seeds) if own else ()
        exact: dict[int, FloatArray] = {}
        for item, value in zip(own, parameters, strict=True):
            if item.index is not None and not self.manifest.loops.chain:
                exact[item.index] = value
            elif item.index is not None and item.name not in fixed_q:
                exact[item.index] = seeds[:, item.index]
        return Chosen(
            info, inverse, moves.with_fixed(info.role.fixed, free=free), parameters, exact, threads
        )

    def _with_joints_fixed(
        self,
        info: FunctionInfo,
        inverse: Function[Solutions],
        moves: Moves,
        target: FloatArray,
        seeds: FloatArray,
        fixed_q: Mapping[str, FloatArray],
    ) -> tuple[Rows, Any]:
        solutions = inverse(target, fixed=fixed_q)
        coordinates = [c.name for c in self.coordinates]
        exact = {coordinates.index(name): fixed_q[name] for name in fixed_q if name in coordinates}
        chosen = Chosen(info, inverse, moves.with_fixed(tuple(exact)), (), exact, 1)
        found = chosen.of_slots(solutions, seeds)
        _set_exact(found, exact)
        return found, solutions.valid.any(-1) & (found[3] < 0)

    def _parameters(self, info: FunctionInfo) -> tuple[Redundancy, ...]:
        return self.redundancy if len(info.inputs) > 1 else ()

    def _objective(self: Any, redundancy: NearestRedundancy, moves: Moves) -> Objective:
        if redundancy == "nearest":
            return lambda q, seeds: -moves.distance(q, seeds)
        if redundancy == "manipulability":
            return lambda q, _: np.asarray(self.manipulability(q).measure)
        lower, upper = moves.lower[: self.n], moves.upper[: self.n]
        bounded = np.isfinite(lower) & np.isfinite(upper) & (lower < upper)
        if not bounded.any():
            raise InputValueError(
                f'{self.name}.ik_nearest: redundancy="limits" needs a joint with two limits'
            )
        lower, upper = lower[bounded], upper[bounded]
        middle, half = (lower + upper) / 2, (upper - lower) / 2
        return lambda q, _: 1 - (np.abs(q[..., bounded] - middle) / half).max(-1)


def nearest_function(robot: NearestMethods, pickled: tuple[Any, ...]) -> Nearest | None:
    """Return the C object `robot.ik_nearest`, or None if the robot has no IK function for poses."""
    own = robot.manifest.with_role("inverse", "pose")
    if own is None:
        return None
    label = f"{robot.name}.ik_nearest"
    method = NearestMethods.ik_nearest
    moves = robot._moves(label, own).with_fixed(own.role.fixed)
    names = [item.name for item in robot.redundancy]
    parameters: Any = () if robot.manifest.loops.chain else own.role.fixed
    redundancy = robot._roles.get(("redundancy", "actuators", ""))
    if redundancy is not None and names == [redundancy.__name__]:
        parameters = redundancy
    inverse, bound = robot.functions[own.name], partial(method, robot)
    return Nearest(
        inverse,
        bound,
        nearest_type(inverse.tolerance),
        moves.arrays,
        parameters,
        label,
        method.__doc__,
        inspect.signature(bound),
        pickled,
    )


def _settled(chosen: Chosen, target: FloatArray, seeds: FloatArray) -> tuple[Rows, Any]:
    found = chosen.solve(target, seeds)
    q, residual, _, slot = found
    if chosen.info.inputs[0].shape == _POSE and np.isinf(residual).any():
        refuse(chosen.inverse.__qualname__, target)
    again = np.flatnonzero((slot < 0) & (residual <= chosen.inverse.near))
    limited: Any = False
    if len(again):
        values = tuple(value[again] for value in chosen.parameters)
        part = target[again]
        solutions = chosen.inverse(part, fixed=values) if values else chosen.inverse(part)
        rows = chosen.of_slots(solutions, seeds[again])
        for k in range(len(found)):
            found[k][again] = rows[k]
        limited = np.zeros(len(q), np.bool_)
        limited[again] = solutions.valid.any(-1) & (rows[3] < 0)
    _set_exact(found, chosen.exact)
    return found, limited


def _set_exact(found: Rows, exact: Mapping[int, FloatArray]) -> None:
    for k, value in exact.items():
        found[0][:, k] = np.where(found[3] >= 0, value, np.nan)


def _packed(
    label: str,
    inverse: Function[Solutions],
    found: Rows,
    limited: Any,
    batch: tuple[int, ...],
    out: Any,
) -> NearestSolution:
    q, residual, margin, slot = found
    fields: list[Any] = [
        q.reshape(*batch, q.shape[-1]),
        residual.reshape(batch),
        margin.reshape(batch),
        (slot >= 0).reshape(batch),
    ]
    kind = nearest_type(inverse.tolerance)
    if np.any(limited):
        kind = limited_type(inverse.tolerance, limited.reshape(batch))
    if out is None:
        return kind(fields[0], *(field[()] for field in fields[1:]))
    return kind(*_written(label, fields, out))


def _written(label: str, fields: list[Any], out: Any) -> list[Any]:
    if not isinstance(out, tuple) or len(out) != len(fields):
        raise InputTypeError(
            f"{label}: out must be a tuple of 4 arrays (q, residual, margin, valid), got {out!r}"
        )
    written = []
    for name, field, array in zip(NearestSolution._fields, fields, out, strict=True):
        if array is None:
            written.append(field if field.ndim and name != "q" else field[()])
            continue
        if not isinstance(array, np.ndarray) or array.dtype != field.dtype:
            raise InputTypeError(f"{label}: out for {name}: expected a {field.dtype} array")
        if array.shape != field.shape:
            raise ShapeError(
                f"{label}: out for {name} must have shape {field.shape}, got shape {array.shape}"
            )
        array[...] = field
        written.append(array)
    return written
