"""Motions of a robot along a curve with a time scaling.

For a curve of the tool, inverse kinematics gives the coordinates at each sample. The coordinates
stay on the inverse kinematics branch nearest to `q_seed`. The tool is on the curve up to rounding
errors, also for coarse samples. Joint rates and accelerations follow from the Jacobian and its
derivative, not from finite differences. Limits are not enforced, but `limit_violations` reports
violations.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass
from functools import cached_property
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chasles import InputValueError, OutOfReachError, Robot
from chasles.contract import check_type
from chasles.fixed import Fixed, read_fixed
from chasles.summaries import summary_repr

from ..arguments import above_0, finite
from ..tolerances import ON_CURVE
from .curves import JointLine, PoseCurve
from .global_redundancy import ParameterCurve, parameter_curve
from .redundancy import minimum_norm
from .task_curves import TaskCurve, TaskLine
from .tasks import curve_rates, parameter_rates, task_rates
from .time_scaling import TimeScaling
from .trajectory import Trajectory

FloatArray = NDArray[np.float64]
Redundancy = Literal["fixed", "minimum_norm", "global"]

_HALVINGS = 4
"""Number of times that the sample spacing is halved before a joint jump is reported as an error."""
_SAMPLES = 521
"""Number of sample poses for the redundancy resolution over the whole curve. The redundancy
resolution satisfies the joint limits at the sample poses."""
_ROUNDING = 1e-9
"""Because of rounding errors, a time scaling may be longer than the curve by this fraction of the
curve length."""


@dataclass(frozen=True, eq=False)
class Motion:
    """A motion of a robot whose tool or joints follow a curve.

    Attributes:
        robot: The robot.
        curve: A curve of tool poses (such as from `line`), of task coordinates (from `task_line` or
            `task_curve`), or of coordinates or joint positions (from `joint_line`).
        time_scaling: The length travelled along the curve as a function of time, from
            `time_scaling`.
        q_seed: (n,) actuated coordinates near the start [rad or m]. The coordinates `q_seed` select
            the inverse kinematics branch for curves of poses or task coordinates.
        fixed: Names or indices of joints that keep their values at `q_seed`, or a mapping from
            joints to values [rad or m]. Fixed joints require a curve of tool poses. If a fixed
            joint is not in `robot.redundancy`, the inverse kinematics is solved by iteration.
        redundancy: How a redundant robot follows the curve. With "fixed", redundancy parameters
            keep their values at `q_seed`. With "minimum_norm", minimum-norm steps of the main-chain
            joints lead from `q_seed` to each pose. With "global", the motion stays within the
            limits and minimizes the integral of the squared joint rates, as in
            `resolve_redundancy`. The start of a "global" motion may differ from `q_seed`.

    Raises:
        InputValueError: `curve` does not support `redundancy` or `fixed`, `time_scaling` is longer
            than the curve, or `q_seed` is not finite.
        ShapeError: `q_seed` is not (n,).
    """

    robot: Robot
    curve: PoseCurve | TaskLine | TaskCurve | JointLine
    time_scaling: TimeScaling
    q_seed: FloatArray
    _: KW_ONLY
    fixed: Fixed | Mapping[str | int, float] | None = None
    redundancy: Redundancy = "fixed"

    def __repr__(self) -> str:
        """Return a short summary with the curve and the duration of the motion."""
        curve = f"{type(self.curve).__name__} of length {self.curve.length:.6g}"
        facts = (curve, f"{self.duration:.6g} s")
        return summary_repr(self, self.robot.name, *facts, methods="sample(frequency), at(t)")

    def __post_init__(self) -> None:
        """Reject arguments that the curve does not support."""
        check_type("Motion: robot", self.robot, Robot)
        if self.redundancy not in get_args(Redundancy):
            raise InputValueError(
                f"Motion: expected redundancy as one of {', '.join(get_args(Redundancy))}, got "
                f"{self.redundancy!r}"
            )
        if isinstance(self.curve, TaskLine | TaskCurve | JointLine):
            if self.redundancy != "fixed":
                raise InputValueError(
                    f"Motion: expected a curve of the tool pose for redundancy {self.redundancy}"
                )
            if self.fixed is not None:
                raise InputValueError("Motion: fixed requires a curve of the tool pose")
        if self.redundancy == "global" and self.fixed is not None:
            raise InputValueError('Motion: redundancy="global" does not support fixed joints')
        finite(f"Motion of {self.robot.name}: q_seed", self.q_seed, (self.robot.n,))
        if self.time_scaling.length > self.curve.length * (1 + _ROUNDING):
            raise InputValueError(
                "Motion: the time scaling and the curve have different lengths: "
                f"{self.time_scaling.length:g} and {self.curve.length:g}"
            )

    @property
    def duration(self) -> float:
        """Duration of the motion [s]."""
        return self.time_scaling.duration

    def sample(self, frequency: float = 100.0) -> Trajectory:
        """Sample the motion at equal time steps, including start and end.

        Args:
            frequency: Number of samples per second, above 0.

        Raises:
            OutOfReachError: The curve leaves the workspace, the inverse kinematics branch or the
                coordinate limits. The message states the position on the curve and the reason.
        """
        return self.at(_times(self.duration, frequency))

    def at(self, t: ArrayLike) -> Trajectory:
        """Sample the motion at times (m,) in ascending order [s].

        Raises:
            InputValueError: The array of times is empty, or the times are not ascending.
            OutOfReachError: As for `sample`.
        """
        times = np.atleast_1d(finite("Motion.at: t", t))
        if not len(times) or (np.diff(times) < 0).any():
            raise InputValueError("Motion.at: expected one or more times in ascending order")
        s, sd, sdd = self.time_scaling.at(times)
        q, by_s, by_ss = self.on_curve(s)
        qd, qdd = by_s * sd[:, None], by_s * sdd[:, None] + by_ss * (sd**2)[:, None]
        T, V = self.robot.fk(q), self.robot.twist_mixed(q, qd)
        names = tuple(coordinate.name for coordinate in self.robot.coordinates)
        stage = np.zeros(len(times), dtype=np.intp)
        return Trajectory(self.robot.name, names, times, q, qd, qdd, T, V, stage)

    def on_curve(self, s: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return coordinates on the curve and their derivatives with respect to the curve length.

        Args:
            s: (m,) lengths along the curve in ascending order.

        Returns:
            (m, n) coordinates, and their first and second derivatives with respect to the curve
            length s.

        Raises:
            OutOfReachError: As for `sample`.
        """
        robot = self.robot
        if isinstance(self.curve, JointLine):
            x, by_s, by_ss = self.curve.at(s)
            if self.curve.space == "coordinates" or not robot.loops:
                return x, by_s, by_ss
            rates = robot.actuator_rates(x, by_s)
            return robot.actuators(x), rates, robot.actuator_accelerations(x, by_s, by_ss)
        if isinstance(self.curve, TaskLine | TaskCurve):
            x, by_s, by_ss = self.curve.at(s)
            q = self._followed(s, self.curve.task)
            return q, *task_rates(robot, self.curve.task, q, by_s, by_ss)
        fixed = self._fixed_names()
        if self.redundancy == "minimum_norm":
            return minimum_norm(robot, self.curve, s, self._q_fixed(), fixed or None)
        T, V, A = self.curve.at(s)
        if self.redundancy == "global":
            q = self._followed(s, "pose")
            spline = self._parameters.spline
            return q, *parameter_rates(robot, q, V, A, (spline(s, 1), spline(s, 2)))
        if set(fixed) <= {item.name for item in robot.redundancy}:
            q = self._followed(s, "pose")
            return q, *parameter_rates(robot, q, V, A)
        q = self._iterated(T, s, fixed)
        return q, *curve_rates(robot, q, V, A, fixed)

    @cached_property
    def _parameters(self) -> ParameterCurve:
        """The redundancy parameters along the curve, from the global redundancy resolution."""
        robot, length = self.robot, self.curve.length
        s = np.linspace(0.0, length, _SAMPLES)
        curve, _ = parameter_curve(robot, s, self.curve.at(s)[0], self.q_seed, robot.limits)
        return curve

    def _fixed_names(self) -> list[str]:
        names = self.robot.coordinate_names
        items = read_fixed("Motion", self.fixed)
        return [item if isinstance(item, str) else names[item] for item in items]

    def _q_fixed(self) -> FloatArray:
        """Return `q_seed` (n,) after setting fixed coordinates and joints to their fixed values."""
        q, joints = np.array(self.q_seed, dtype=np.float64), self.robot.joint_names
        values = read_fixed("Motion", self.fixed).values()
        for name, value in zip(self._fixed_names(), values, strict=True):
            if value is None:
                continue
            if name in self.robot.coordinate_names:
                q[self.robot.coordinate_names.index(name)] = value
            elif name in joints:
                theta = self.robot.chain(q)
                theta[joints.index(name)] = value
                q = self.robot.actuators(theta)
        return q

    def _followed(self, s: FloatArray, task: Any) -> FloatArray:
        """Return coordinates at curve lengths s (m,), on the inverse kinematics branch of `q_seed`.

        If a joint jumps between samples, the inverse kinematics is also computed at intermediate
        poses.
        """
        for halvings in range(_HALVINGS + 1):
            parts = 2**halvings
            finer = np.interp(np.arange((len(s) - 1) * parts + 1) / parts, np.arange(len(s)), s)
            target = self.curve.at(finer)[0]
            start, fixed = self.q_seed, self.fixed
            if self.redundancy == "global":
                start, fixed = self._parameters.q_start, self._parameters.at(finer)
            path = self.robot.ik_path(target, start, task=task, fixed=fixed)
            if path.complete:
                return np.asarray(path.q[::parts])
            if path.reason != "jump" or len(s) == 1:
                break
        raise OutOfReachError(
            f"{self.robot.name}: at {self._part(finer[path.ended_at])} the motion stops: {path}"
        )

    def _part(self, s: float) -> str:
        return f"{s / self.curve.length:.1%} of the curve"

    def _iterated(self, T: FloatArray, s: FloatArray, fixed: list[str]) -> FloatArray:
        q, q_seed = np.empty((len(T), self.robot.n)), self._q_fixed()
        for k, pose in enumerate(T):
            found = self.robot.ik_numeric(
                pose, q_seed, fixed=fixed, tolerance=ON_CURVE * self.robot.unit_length
            )
            if not found.valid:
                raise OutOfReachError(
                    f"{self.robot.name}: at {self._part(s[k])} the motion stops: the tool "
                    f"misses the curve by {found.residual:.3g} m with {', '.join(fixed)} fixed"
                )
            q[k] = q_seed = found.q
        return q


def _times(duration: float, frequency: float) -> FloatArray:
    above_0("sample: frequency", frequency)
    count = max(round(duration * frequency), 1)
    return np.linspace(0, duration, count + 1)
