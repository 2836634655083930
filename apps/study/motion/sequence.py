"""Sequences of motions and pauses.

    laying = (
        MotionSequence(robot, q_start)
        .move(q_1, "quintic", duration=2)
        .pause(0.5)
        .follow(line(robot.fk(q_1), T_2), "trapezoidal", speed=0.2, acceleration=1)
    )
    trajectory = laying.sample(frequency=100)

Each stage (motion or pause) begins at the final configuration of the previous stage.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chasles import InputValueError, OutOfReachError, Robot
from chasles.contract import check_type
from chasles.fixed import Fixed
from chasles.summaries import summary_repr

from ..arguments import above_0, finite
from ..planning.plan import Plan
from .curves import JointLine, PoseCurve, Space, joint_line
from .motion import Motion, Redundancy
from .task_curves import TaskCurve, TaskLine
from .time_scaling import Profile, TimeScaling, time_scaling
from .trajectory import Trajectory, concatenate

FloatArray = NDArray[np.float64]

_LONG = 200
"""Maximum total length of the stage names in a summary [characters]."""
_SAME = 1e-9
"""Maximum difference between the end of a stage and the start of the next curve or plan. The
tolerance applies to the entries of pose matrices for a curve [m or 1], and to the coordinates for a
plan [rad or m]."""


@dataclass(frozen=True, eq=False)
class Stage:
    """A stage of a motion sequence: a motion or a pause.

    Attributes:
        motion: The motion.
        q_end: (n,) coordinates at the end of the stage [rad or m].
        name: Name of the stage.
    """

    motion: Motion
    q_end: FloatArray
    name: str

    def __repr__(self) -> str:
        """Short summary with the main values."""
        return summary_repr(self, "", self.name, f"{self.motion.duration:.6g} s")


@dataclass(frozen=True, eq=False)
class MotionSequence:
    """A sequence of motions and pauses (stages). The methods that add stages return a new sequence.

    Attributes:
        robot: The robot.
        q_start: (n,) actuated coordinates at the start [rad or m].
    """

    robot: Robot
    q_start: FloatArray
    _stages: tuple[Stage, ...] = ()

    def __repr__(self) -> str:
        """Short summary with the main values."""
        names = ", ".join(stage.name for stage in self._stages)
        return summary_repr(
            self,
            self.robot.name,
            f"{len(self._stages)} stages in {self.duration:.6g} s",
            names if len(names) < _LONG else "",
            methods="move, pause, follow, sample(frequency), jumps()",
        )

    def __post_init__(self) -> None:
        """Check q_start."""
        check_type("MotionSequence: robot", self.robot, Robot)
        finite(f"MotionSequence of {self.robot.name}: q_start", self.q_start, (self.robot.n,))

    @property
    def q_end(self) -> FloatArray:
        """(n,) coordinates at the end [rad or m]."""
        return self._stages[-1].q_end if self._stages else np.asarray(self.q_start, np.float64)

    @property
    def duration(self) -> float:
        """Total duration of all stages [s]."""
        return sum(stage.motion.duration for stage in self._stages)

    def move(
        self,
        q_goal: ArrayLike,
        profile: Profile,
        *,
        space: Space = "coordinates",
        name: str = "",
        **limits: float,
    ) -> Self:
        """Add a motion on a straight line in the coordinates.

        Args:
            q_goal: (n,) coordinates at the end of the line [rad or m]. For space "chain", `q_goal`
                contains joint positions of the main chain.
            profile: "constant", "cubic", "quintic", "trapezoidal" or "s_curve", as in
                `time_scaling`.
            space: "coordinates", or "chain" for a straight line in the joints of the main chain.
            name: The name of the stage.
            limits: The arguments duration, speed, acceleration and jerk of `time_scaling`, for a
                path of length 1 from start to end of the line.
        """
        begin = self.q_end
        if space == "chain" and self.robot.loops:
            begin = self.robot.chain(begin)
        curve = joint_line(begin, q_goal, space=space)
        timed = time_scaling(profile, 1.0, **limits)
        return self._with(Motion(self.robot, curve, timed, self.q_end), name)

    def pause(self, duration: float, name: str = "") -> Self:
        """Add a pause.

        Args:
            duration: Duration of the pause [s].
            name: The name of the stage.

        Raises:
            InputValueError: `duration` is not a finite number above 0.
        """
        above_0("pause: duration", duration)
        rest = TimeScaling(np.array([0.0, duration]), np.zeros((1, 1)), 0.0)
        curve = joint_line(self.q_end, self.q_end)
        return self._with(Motion(self.robot, curve, rest, self.q_end), name)

    def follow(
        self,
        curve: PoseCurve | TaskLine | TaskCurve | Plan,
        profile: Profile,
        *,
        fixed: Fixed | Mapping[str | int, float] | None = None,
        redundancy: Redundancy = "fixed",
        name: str = "",
        **limits: float,
    ) -> Self:
        """Add a motion on a curve or on a planned path that starts at the current configuration.

        Each segment of a planned path is a stage that starts and ends at rest.

        Args:
            curve: A curve of tool poses or task coordinates, or a `Plan` in the actuated
                coordinates.
            profile: "constant", "cubic", "quintic", "trapezoidal" or "s_curve", as in
                `time_scaling`.
            fixed: Joints with constant values, as in `Motion`. Joints that are listed without a
                value keep the value that they have at the start of the stage.
            redundancy: "fixed" or "minimum_norm", as in `Motion`.
            name: The name of the stage.
            limits: The arguments duration, speed, acceleration and jerk of `time_scaling`, for the
                length along the curve. For a plan, duration is the time of the whole path, and the
                other arguments refer to the path length in the coordinates.

        Raises:
            InputValueError: The curve or plan does not start at the end of the previous stage, the
                plan has no path, or `redundancy` is "global".
            OutOfReachError: The curve leaves the workspace, the inverse kinematics branch or the
                coordinate limits.
        """
        if redundancy == "global":
            raise InputValueError(
                "follow: redundancy='global' chooses the start of the motion; use Motion, and move "
                "to its start"
            )
        if isinstance(curve, Plan):
            if fixed is not None or redundancy != "fixed":
                raise InputValueError("follow: a plan does not support fixed= and redundancy=")
            return self._follow_plan(curve, profile, name, limits)
        if not isinstance(curve, TaskLine | TaskCurve):
            self._require_start(curve.at(np.zeros(1)).T[0])
        timed = time_scaling(profile, curve.length, **limits)
        motion = Motion(self.robot, curve, timed, self.q_end, fixed=fixed, redundancy=redundancy)
        return self._with(motion, name)

    def _follow_plan(
        self, plan: Plan, profile: Profile, name: str, limits: dict[str, float]
    ) -> Self:
        if not plan.found:
            raise InputValueError(f"follow: the plan has no path: {plan.reason}")
        off = np.abs(plan.q[0] - self.q_end).max()
        if not off <= _SAME:
            raise InputValueError(
                f"follow: the plan must start at q_end; it differs by {off:.3g} rad or m"
            )
        longer = self
        for k, (a, b) in enumerate(pairwise(plan.q), 1):
            length = float(np.linalg.norm(b - a))
            own = dict(limits)
            if "duration" in own:
                own["duration"] *= length / plan.length
            timed = time_scaling(profile, length, **own)
            motion = Motion(self.robot, JointLine(a, b, length=length), timed, a)
            longer = longer._with(motion, f"{name} {k}" if name else "")
        return longer

    def _require_start(self, there: FloatArray) -> None:
        off = self.robot.fk(self.q_end) - there
        if not np.abs(off).max() <= _SAME:
            raise InputValueError(
                "follow: the curve must start at the tool pose; positions differ by "
                f"{np.linalg.norm(off[:3, 3]):.3g} m, rotations by {np.abs(off[:3, :3]).max():.3g}"
            )

    def sample(self, frequency: float = 100.0) -> Trajectory:
        """Sample all stages. The field `stage` of the result is the stage index of each sample.

        Args:
            frequency: Number of samples per second, above 0.

        Raises:
            InputValueError: No stage was added to the sequence.
            OutOfReachError: A curve leaves the workspace, the inverse kinematics branch or the
                coordinate limits.
        """
        if not self._stages:
            raise InputValueError(
                "MotionSequence.sample: there is no stage yet; call move, pause or follow"
            )
        return concatenate([stage.motion.sample(frequency) for stage in self._stages])

    def jumps(self) -> list[tuple[int, str, float, float]]:
        """List jumps in the time scalings as (stage, derivative, time [s], jump size)."""
        found, begin = [], 0.0
        for index, stage in enumerate(self._stages):
            timed = stage.motion.time_scaling
            found += [(index, name, begin + time, step) for name, time, step in timed.jumps()]
            begin += timed.duration
        return found

    def _with(self, motion: Motion, name: str) -> Self:
        own = name or f"stage {len(self._stages) + 1}"
        ends = motion.sample(_CHECKS / motion.duration) if motion.time_scaling.length else None
        q_end = self.q_end if ends is None else ends.q[-1]
        if not np.isfinite(q_end).all():
            raise OutOfReachError(f"{self.robot.name}: the loops do not close at the end of {own}")
        stage = Stage(motion, q_end, own)
        return replace(self, _stages=(*self._stages, stage))


_CHECKS = 100
"""Number of samples at which a new stage of the motion is checked."""
