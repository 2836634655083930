"""Iterative inverse kinematics for every robot, within its limits.

The iteration in C (_numeric.c) calls the compiled robot functions. The iteration starts from a
table of configurations within the limits, sorted by distance from the pose.

Source:
    Sugihara, Solvability-unconcerned inverse kinematics by the Levenberg-Marquardt method, 2011.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import BoolArray, FloatArray, real_array, whole_number
from ..call.capabilities import needs
from ..call.threads import count_cores
from ..contract import Manifest
from ..errors import InputValueError, ShapeError
from ..facts import RobotFacts
from ..fixed import fixed_coordinates, read_fixed
from ..sampling import low_discrepancy
from ..size import ranges
from ..tolerances import SOLVED
from ._numeric import Solver

REASONS = ("", "limits", "stalled", "max_evaluations", "not a pose")
_WHOLE = np.ones(6)
_TOOL = ("fk_jacobian_mixed", "hessian_mixed")
"""Names of the generated functions that the solver for tool poses calls."""
_STARTS = 256
_FEWEST = 32
"""Minimum number of start configurations with closed loops."""
_MAX_SOLVERS = 64
"""Maximum number of cached solvers of a robot. A full cache is cleared."""
_MAX_EVALUATIONS = 2**31 - 1


class NumericSolution(NamedTuple):
    """The results of iterative inverse kinematics.

    Attributes:
        q: (..., n) coordinates [rad or m], within the limits, or NaN if a pose is not finite.
        residual: (...,) the larger of the distance error [m] and the angle error times
            `unit_length`. Components without a positive weight are ignored.
        valid: (...,) whether the residual is at most the tolerance. For rounded poses, a
            least-squares solution is valid up to a residual of 10 `unit_length` times the rounding
            error. The rounding error is `se3.deviation` or half a unit of the last decimal place of
            the rotation entries, whichever is larger.
        ending: (...,) reason for termination, as an index into `REASONS`; see `reason`.
        iterations: (...,) number of forward kinematics evaluations.
        restarts: (...,) number of start configurations after the first.
    """

    q: FloatArray
    residual: FloatArray
    valid: BoolArray
    ending: NDArray[np.int8]
    iterations: NDArray[np.int32]
    restarts: NDArray[np.int32]

    @property
    def reason(self) -> Any:
        """The reason for a missing solution: a str for a single pose, otherwise an array (...,).

        For a valid solution, the reason is an empty string. The reason "limits" means a local
        minimum of the residual with coordinates at their limits; "stalled" means a local minimum
        within the limits; "max_evaluations" means that no evaluations were left. "not a pose" means
        that the matrix is not finite, or deviates from a rigid pose by more than
        `se3.NEARLY_RIGID`. The error of `se3.project` states why a matrix is not a pose.
        """
        reasons = np.array(REASONS)[self.ending]
        return reasons if reasons.ndim else str(reasons)

    def __str__(self) -> str:
        if self.valid.ndim == 0:
            steps = f"{self.iterations} iteration{'' if self.iterations == 1 else 's'}"
            return f"{self.reason or 'solved'} after {steps}, residual {self.residual:.3g}"
        counts = np.bincount(self.ending.reshape(-1), minlength=len(REASONS))
        of = [f"{n} {name or 'solved'}" for n, name in zip(counts, REASONS, strict=True) if n]
        worst = np.nanmax(self.residual, initial=0.0)
        return f"{self.valid.size} poses: {', '.join(of)}; largest residual {worst:.3g}"


def _can_reach_links(robot: RobotFacts) -> bool:
    return ("link poses", "actuators", "") in robot._roles and robot.manifest.skeleton is not None


class NumericMethods(RobotFacts):
    """Robot methods for iterative inverse kinematics."""

    @functools.cached_property
    def _solvers(self) -> dict[tuple[str | None, int], Solver]:
        return {}

    @needs("fk", *_TOOL)
    def ik_numeric(
        self,
        T: ArrayLike,
        q_seed: ArrayLike | None = None,
        *,
        tip: str | None = None,
        task_weights: Sequence[float] | None = None,
        frame: Literal["tool", "base"] = "tool",
        fixed: Any = None,
        tolerance: float | None = None,
        max_evaluations: int = 10_000,
        rng: int | np.random.Generator | None = 0,
        threads: int | Literal["all"] = 1,
    ) -> NumericSolution:
        """Solve inverse kinematics by iteration within the limits.

        The iteration takes Levenberg-Marquardt steps that stay within the joint limits. The damping
        lambda is proportional to the squared error. The proportionality factor decreases after
        successful steps and increases after failed steps. An iteration that does not reach the pose
        restarts from another configuration. For a pose out of reach, the result is the
        configuration with the smallest residual found, and `valid` is False.

        Args:
            T: (..., 4, 4) poses of the tip in the base frame. Deviations from rigid poses up to
                `se3.NEARLY_RIGID` are corrected; larger deviations result in NaN.
            q_seed: (..., n) start coordinates [rad or m], clipped to the limits. The default is the
                configuration with the nearest pose, out of at most 256 sampled configurations.
            tip: The link that must reach the pose, one of `robot.link_names`; the tool by default.
                For robots without `link_poses`, the tool is the only valid tip.
            task_weights: Six weights of the error components (v, omega), 0 for a free component:
                (1, 1, 1, 0, 0, 0) for a position. By default, all weights are 1, so that an error
                of `robot.unit_length` is equivalent to 1 rad.
            frame: The axes of the weighted error components: "tool" (the tip) or "base".
            fixed: Coordinates with exact values, even outside the limits: names or indices of
                coordinates that keep their values at `q_seed`, or a mapping from names to values
                (...) [rad or m]. A main-chain joint selects the coordinate that moves this joint.
            tolerance: Maximum residual of a solution [m]; by default 1e-9 `robot.unit_length`.
            max_evaluations: Maximum number of forward kinematics evaluations per pose. For a
                six-joint arm, an evaluation takes about 0.4 microseconds.
            rng: Integer seed or random generator for the start configurations, or None for new
                random starts in each call. Results do not depend on the number of threads.
            threads: The number of threads, or "all" for one thread per core.

        Returns:
            `q (..., n)` [rad or m], `residual` [m], `valid`, `ending`, `iterations` and `restarts`,
            each `(...,)`. The property `reason` explains a missing solution.

        Raises:
            ShapeError: If a shape is wrong, or the leading dimensions do not broadcast.
            InputTypeError: If `fixed` is neither a mapping nor names.
            InputValueError: If a link, coordinate or option is unknown, if a weight is negative, if
                all weights are 0, or if `fixed` needs `q_seed` and `q_seed` is missing.
        """
        method = f"{self.name}.ik_numeric"
        if frame not in ("tool", "base"):
            raise InputValueError(f'{method}: expected frame "tool" or "base", got {frame!r}')
        unit = self.unit_length
        tolerance = SOLVED * unit if tolerance is None else tolerance
        if not (isinstance(tolerance, int | float) and tolerance > 0):
            raise InputValueError(f"{method}: expected a tolerance above 0, got {tolerance!r}")
        evaluations = whole_number(method, "max_evaluations", max_evaluations, 1, _MAX_EVALUATIONS)
        n_threads = count_cores() if threads == "all" else threads
        count = whole_number(method, "threads", n_threads, 1, None)
        if rng is None or isinstance(rng, np.random.Generator):
            rng = int(np.random.default_rng(rng).integers(2**63))
        start_set = whole_number(method, "rng", rng, 0, None)
        solver = self._solvers.get((tip, start_set)) or self._new_solver(tip, start_set)
        poses = real_array(method, "T", T)
        if poses.shape[-2:] != (4, 4):
            raise ShapeError(f"{method}: expected poses T (..., 4, 4), got shape {poses.shape}")
        items, begin = read_fixed(method, fixed), None
        locked = fixed_coordinates(self, "ik_numeric", list(items) or None)
        if items:
            q_seed = self._with_fixed(method, items, q_seed)
        if q_seed is not None:
            poses, begin = self._with_seeds(poses, q_seed, locked)
        task = _WHOLE if task_weights is None else _weights(method, task_weights)
        # With equal weights the result does not depend on the frame.
        in_tool_axes = frame == "tool" and task is not _WHOLE
        return NumericSolution._make(
            solver.solve(
                poses, begin, task, in_tool_axes, tolerance, unit, evaluations, count, locked
            )
        )

    def _with_fixed(
        self, method: str, items: Mapping[str | int, ArrayLike | None], q_seed: ArrayLike | None
    ) -> FloatArray:
        if q_seed is None and None in items.values():
            raise InputValueError(
                f"{method}: fixed= without values requires q_seed; pass q_seed, or a mapping from "
                "names to values"
            )
        begin = real_array(method, "q_seed", self.q_reference if q_seed is None else q_seed)
        names = [coordinate.name for coordinate in self.coordinates]
        for item, given in items.items():
            if given is None:
                continue
            value = real_array(method, str(item), given)
            try:
                batch = np.broadcast_shapes(value.shape, begin.shape[:-1])
            except ValueError:
                raise ShapeError(
                    f"{method}: fixed values must broadcast with q_seed and each other; got shape "
                    f"{value.shape} for {item}, expected {begin.shape[:-1]}"
                ) from None
            begin = np.array(np.broadcast_to(begin, (*batch, self.n)))
            if not isinstance(item, str) or item in names:
                begin[..., item if not isinstance(item, str) else names.index(item)] = value
                continue
            index = [joint.name for joint in self.chain_joints].index(item)
            moving = np.flatnonzero(fixed_coordinates(self, "ik_numeric", item))
            theta = self.chain(begin)
            theta[..., index] = value
            begin[..., moving] = self.actuators(theta)[..., moving]
        return begin

    def _new_solver(self, tip: str | None, start_set: int) -> Solver:
        """Create and cache a solver; creation takes as long as solving a thousand poses."""
        if len(self._solvers) >= _MAX_SOLVERS:
            self._solvers.clear()
        return self._solvers.setdefault((tip, start_set), _solver(self, tip, start_set))

    def _with_seeds(
        self, poses: FloatArray, q_seed: ArrayLike, locked: BoolArray
    ) -> tuple[FloatArray, FloatArray]:
        method = f"{self.name}.ik_numeric"
        begin = real_array(method, "q_seed", q_seed)
        if begin.shape[-1:] != (self.n,):
            raise ShapeError(f"{method}: expected q_seed (..., {self.n}), got shape {begin.shape}")
        try:
            batch = np.broadcast_shapes(poses.shape[:-2], begin.shape[:-1])
        except ValueError:
            raise ShapeError(
                f"{method}: leading dimensions do not broadcast: {poses.shape[:-2]} of T and "
                f"{begin.shape[:-1]} of q_seed"
            ) from None
        poses = np.broadcast_to(poses, (*batch, 4, 4))
        inside = np.where(locked, begin, np.clip(begin, self.lower, self.upper))
        begin = np.broadcast_to(inside, (*batch, self.n))
        return poses, begin.reshape(-1, self.n)


def _weights(method: str, given: Sequence[float]) -> FloatArray:
    weights = real_array(method, "task_weights", given)
    if weights.shape != (6,):
        raise ShapeError(f"{method}: expected six task_weights, got shape {weights.shape}")
    if not (weights >= 0).all() or not weights.any() or not np.isfinite(weights).all():
        raise InputValueError(
            f"{method}: task_weights must be finite and nonnegative, and at least one must be "
            f"positive; got {weights.tolist()}"
        )
    return weights


def _solver(robot: RobotFacts, tip: str | None, start_set: int) -> Solver:
    limits, q = (robot.lower, robot.upper), starts(robot, start_set)
    if tip is None or tip == robot.tip_frame:
        return Solver(_kernels(robot, _TOOL), *limits, q, _entries(robot.fk(q)))
    offered = robot.link_names if _can_reach_links(robot) else ()
    if tip not in offered:
        links = ", ".join((robot.tip_frame, *offered))
        raise InputValueError(
            f"{robot.name}.ik_numeric: unknown tip link {tip!r}; expected one of {links}"
        )
    link = robot.link_names.index(tip)
    kernels = _kernels(robot, ["link_poses", *(["chain_D_q"] if robot.loops else [])])
    poses = _entries(robot.link_poses(q)[:, link])
    return Solver(kernels, *limits, q, poses, link, screws_up_to(robot.manifest, link))


def _kernels(robot: RobotFacts, names: Sequence[str]) -> tuple[object, ...]:
    return tuple(robot.functions[name].kernel for name in names)


def _entries(T: FloatArray) -> FloatArray:
    return np.ascontiguousarray(T[:, :3].reshape(-1, 12).T)


def starts(robot: RobotFacts, start_set: int) -> FloatArray:
    """Return start configurations q (m, n) within the coordinate ranges and with closed loops.

    `start_set` is the random seed.
    """
    lower, upper = ranges(robot.coordinates, robot.reference)
    first = np.random.default_rng(start_set).random(robot.n)
    found = np.empty((0, robot.n))
    for k in range(_STARTS // _FEWEST):
        points = low_discrepancy(k * _STARTS, (k + 1) * _STARTS, robot.n, first)
        q = lower + points * (upper - lower)
        closes = np.isfinite(robot.fk(q)).all((-2, -1))
        found = np.vstack([found, q[closes]])
        if len(found) >= _FEWEST:
            break
    return found[:_STARTS]


def screws_up_to(manifest: Manifest, link: int) -> FloatArray:
    """Return rows (s, 8) of (link, joint, v, omega), one for each of the s joints up to a link.

    The vectors v and omega are expressed in the frame of the link that the joint moves. A joint
    outside the main chain raises an InputValueError.
    """
    assert manifest.skeleton is not None
    variables = manifest.loops.configuration or manifest.coordinates
    moved = [j.name for j in (manifest.loops.configuration and manifest.loops.chain) or variables]
    names, bodies, rows = manifest.frames.links[: link + 1], manifest.skeleton.bodies, []
    carriers = [next(body for body in bodies if body.name == names[-1])]
    while parent := carriers[0].parent:
        carriers.insert(0, bodies[parent])
    # A joint with several coordinates has several bodies.
    for i, body in enumerate(carriers):
        k, joint = sum(one.name in names for one in carriers[:i]), body.joint
        if joint is None or joint.kind == "fixed":
            continue
        mover = variables[joint.coordinate].name
        if mover not in moved:
            raise InputValueError(
                f"{manifest.name}.ik_numeric: expected a tip link that only the main chain moves; "
                f"{body.name} depends on joint {mover}"
            )
        axis = joint.ratio * np.array(joint.axis)
        along, omega = joint.advance * axis, axis
        if joint.kind == "prismatic":
            along, omega = axis, np.zeros(3)
        rows.append([k, moved.index(mover), *(along + np.cross(joint.at, omega)), *omega])
    return np.array(rows, np.float64).reshape(-1, 8)
