"""Motions: a robot on a curve in the time of a law, sampled with all rates and accelerations.

Where the curve is the tool's, the coordinates follow from the inverse on the branch nearest to the
seed, at each sample for itself: the tool stays on the curve to the rounding of the inverse, however
coarse the samples. Rates and accelerations follow from the Jacobian and its derivative, not from
differences. Limits are checked and told, never enforced by clipping.
"""

from __future__ import annotations

import csv
import os
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chasles import InputValueError, OutOfReachError, Robot, ShapeError
from chasles.locks import Lock
from chasles.summaries import summary_repr

from ..arguments import above_0, finite
from ..tolerances import ON_CURVE
from .curves import JointLine, PoseCurve, TaskCurve, TaskLine
from .laws import Law
from .redundancy import minimum_norm
from .tasks import curve_rates, task_rates

FloatArray = NDArray[np.float64]
Redundancy = Literal["nearest", "minimum_norm"]

_HALVINGS = 4
"""How often the ways between samples are halved where a joint would jump, before it is believed."""
_BEYOND = 1e-9
"""Part of a limit by which rounding may exceed it."""


@dataclass(frozen=True, eq=False)
class Sampled:
    """A motion at equal times.

    Attributes:
        robot: The robot's name.
        names: The names of its coordinates.
        t: (m,) times [s].
        q: (m, n) coordinates [rad or m].
        qd: (m, n) rates [rad/s or m/s].
        qdd: (m, n) accelerations [rad/s^2 or m/s^2].
        T: (m, 4, 4) poses of the tool `T_0_ee`.
        V: (m, 6) mixed twists of the tool [m/s, rad/s].
        stage: (m,) the index of the stage of a sequence; 0 in a single motion.
    """

    robot: str
    names: tuple[str, ...]
    t: FloatArray
    q: FloatArray
    qd: FloatArray
    qdd: FloatArray
    T: FloatArray
    V: FloatArray
    stage: NDArray[np.intp]

    def __repr__(self) -> str:
        """In words, with the figures that matter."""
        stages = f"{self.stage[-1] + 1} stages" if self.stage[-1] else ""
        return summary_repr(
            self,
            self.robot,
            f"{len(self.t):,} times from {self.t[0]:.6g} to {self.t[-1]:.6g} s",
            stages,
            f"largest rate {np.abs(self.qd).max():.4g}, acceleration {np.abs(self.qdd).max():.4g}",
            methods="t, q, qd, qdd, T, V, plot(), to_csv(path), to_npz(path)",
        )

    def to_npz(self, path: str | os.PathLike[str]) -> None:
        """Writes all arrays to a compressed file that NumPy reads."""
        np.savez_compressed(
            Path(path), **{item.name: getattr(self, item.name) for item in fields(self)}
        )

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Writes a line a sample: time, coordinates, rates, accelerations, position of the tool."""
        head = ["t [s]", *self.names, *(f"{n} rate" for n in self.names)]
        head += [*(f"{n} acceleration" for n in self.names), "x [m]", "y [m]", "z [m]"]
        rows = np.column_stack([self.t, self.q, self.qd, self.qdd, self.T[:, :3, 3]])
        with Path(path).open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(head)
            writer.writerows([repr(float(value)) for value in row] for row in rows)

    def plot(self, ax: Any = None) -> Any:
        """Draws coordinates, rates and accelerations over time.

        Args:
            ax: Three matplotlib axes; None: a new figure.

        Returns:
            The three axes.
        """
        from ..pictures import plot_motion  # noqa: PLC0415

        return plot_motion(self, ax)


@dataclass(frozen=True, eq=False)
class Excess:
    """A limit that a motion exceeds.

    Attributes:
        name: The coordinate.
        limit: "lower", "upper", "rate" or "acceleration".
        by: The largest excess [rad or m, per second, per second squared].
        at: The time of the largest excess [s].
    """

    name: str
    limit: str
    by: float
    at: float

    def __str__(self) -> str:
        """In a sentence."""
        return f"{self.name} exceeds its {self.limit} limit by {self.by:.3g} at {self.at:.3f} s"


@dataclass(frozen=True, eq=False)
class Motion:
    """A robot on a curve.

    Attributes:
        robot: The robot.
        curve: The curve, of the tool, of a task's coordinates or of the robot's.
        law: The length covered as a function of time; its length is that of the curve.
        seed: (n,) coordinates near the start, which choose the branch of a curve of the tool.
        given: The further inputs of the robot's `ik`, constant.
        lock: Coordinates that keep their values of the seed; then the others follow by iteration.
        redundancy: What chooses among the postures of a pose of the tool: "nearest": the branch of
            the inverse, or with a lock the iteration, that continues the sample before;
            "minimum_norm": steps of minimum norm in the joints of the main chain, from the seed
            anew for each pose, as in `redundancy.minimum_norm`.

    Raises:
        InputValueError: There is no such redundancy, "minimum_norm" has no curve of the tool, the
            law goes beyond the end of the curve, or the seed is not finite.
        ShapeError: The seed is not (n,).
    """

    robot: Robot
    curve: PoseCurve | TaskLine | TaskCurve | JointLine
    law: Law
    seed: FloatArray
    given: tuple[float, ...] = ()
    lock: Lock | None = None
    redundancy: Redundancy = "nearest"

    def __repr__(self) -> str:
        """In words, with the figures that matter."""
        way = f"{type(self.curve).__name__} of length {self.curve.length:.6g}"
        facts = (way, f"{self.duration:.6g} s")
        return summary_repr(self, self.robot.name, *facts, methods="sample(rate), at(t)")

    def __post_init__(self) -> None:
        """Refuses a redundancy or a law that does not fit the curve."""
        if self.redundancy not in get_args(Redundancy):
            raise InputValueError(
                f"Motion: expected a redundancy out of {', '.join(get_args(Redundancy))}, got "
                f"{self.redundancy!r}"
            )
        if self.redundancy == "minimum_norm" and isinstance(
            self.curve, TaskLine | TaskCurve | JointLine
        ):
            raise InputValueError("Motion: minimum_norm needs a curve of the tool's pose")
        finite(f"Motion of {self.robot.name}: seed", self.seed, (self.robot.n,))
        if self.law.length > self.curve.length * (1 + _BEYOND):
            raise InputValueError(
                f"Motion: the law covers {self.law.length:g}, the curve has {self.curve.length:g}"
            )

    @property
    def duration(self) -> float:
        """The time it takes [s]."""
        return self.law.duration

    def sample(self, rate: float = 100.0) -> Sampled:
        """The motion at a rate, from its start to its end inclusive.

        Args:
            rate: Samples per second.

        Raises:
            OutOfReachError: The curve leaves the reach, the branch or the limits; the message says
                where and why.
        """
        return self.at(_times(self.duration, rate))

    def at(self, t: ArrayLike) -> Sampled:
        """The motion at times (m,) in ascending order [s].

        Raises:
            InputValueError: There are no times, or they do not ascend.
            OutOfReachError: As of `sample`.
        """
        times = np.atleast_1d(finite("Motion.at: t", t))
        if not len(times) or (np.diff(times) < 0).any():
            raise InputValueError("Motion.at: expected times in ascending order, at least one")
        s, sd, sdd = self.law.at(times)
        q, by_s, by_ss = self.on_curve(s)
        qd, qdd = by_s * sd[:, None], by_s * sdd[:, None] + by_ss * (sd**2)[:, None]
        T, V = self.robot.fk(q), self.robot.twist_mixed(q, qd)
        names = tuple(coordinate.name for coordinate in self.robot.coordinates)
        stage = np.zeros(len(times), dtype=np.intp)
        return Sampled(self.robot.name, names, times, q, qd, qdd, T, V, stage)

    def on_curve(self, s: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The coordinates on the curve, without time.

        Args:
            s: (m,) lengths in ascending order.

        Returns:
            (m, n) coordinates and their first and second derivative by s.

        Raises:
            OutOfReachError: As of `sample`.
        """
        robot = self.robot
        if isinstance(self.curve, JointLine):
            x, by_s, by_ss = self.curve.at(s)
            if self.curve.of == "coordinates" or not robot.loops:
                return x, by_s, by_ss
            rates = robot.actuator_rates(x, by_s)
            return robot.actuators(x), rates, robot.actuator_accelerations(x, by_s, by_ss)
        if isinstance(self.curve, TaskLine | TaskCurve):
            x, by_s, by_ss = self.curve.at(s)
            q = self._followed(s, self.curve.task)
            return q, *task_rates(robot, self.curve.task, q, by_s, by_ss)
        if self.redundancy == "minimum_norm":
            return minimum_norm(robot, self.curve, s, self.seed, self.lock)
        T, V, A = self.curve.at(s)
        q = self._followed(s, "pose") if self.lock is None else self._iterated(T, s)
        return q, *curve_rates(robot, q, V, A, self._locked)

    @property
    def _locked(self) -> Lock | None:
        """Coordinates that do not move: the locked ones, and those that the inverse is given."""
        return self.robot.given or None if self.lock is None else self.lock

    def _followed(self, s: FloatArray, task: Any) -> FloatArray:
        """The branch through the seed; where a joint moves far between samples, through more."""
        for halvings in range(_HALVINGS + 1):
            parts = 2**halvings
            finer = np.interp(np.arange((len(s) - 1) * parts + 1) / parts, np.arange(len(s)), s)
            target = self.curve.at(finer)[0]
            path = self.robot.ik_path(target, self.seed, *self.given, task=task)
            if path.complete:
                return np.asarray(path.q[::parts])
            if path.reason != "jump" or len(s) == 1:
                break
        raise OutOfReachError(
            f"{self.robot.name}: at {self._part(finer[path.ended_at])} the motion cannot go on: "
            f"{path}"
        )

    def _part(self, s: float) -> str:
        return f"{s / self.curve.length:.1%} of the curve"

    def _iterated(self, T: FloatArray, s: FloatArray) -> FloatArray:
        q, seed = np.empty((len(T), self.robot.n)), self.seed
        for k, pose in enumerate(T):
            found = self.robot.ik_numeric(
                pose, seed, lock=self.lock, tolerance=ON_CURVE * self.robot.unit_length
            )
            if not found.success:
                raise OutOfReachError(
                    f"{self.robot.name}: at {self._part(s[k])} the motion cannot go on: with "
                    f"{self.lock} locked the tool misses the curve by {found.residual:.3g} m"
                )
            q[k] = seed = found.q
        return q


def excesses(
    robot: Robot,
    sampled: Sampled,
    *,
    rates: ArrayLike | None = None,
    accelerations: ArrayLike | None = None,
) -> list[Excess]:
    """The limits that a sampled motion exceeds, the largest excess of each.

    Args:
        robot: The robot.
        sampled: Its motion.
        rates: () or (n,) largest rates [rad/s or m/s]; None: not checked.
        accelerations: () or (n,) largest accelerations; None: not checked.

    Raises:
        ShapeError: Limits are not n values.
        InputValueError: A limit is not above 0.
    """
    bounds = [("lower", -sampled.q, -robot.lower), ("upper", sampled.q, robot.upper)]
    if rates is not None:
        bounds.append(("rate", np.abs(sampled.qd), per_coordinate("rate", rates, robot.n)))
    if accelerations is not None:
        most = per_coordinate("acceleration", accelerations, robot.n)
        bounds.append(("acceleration", np.abs(sampled.qdd), most))
    found = []
    for name, values, limit in bounds:
        allowed = np.where(
            np.isfinite(limit), limit + _BEYOND * np.maximum(np.abs(limit), 1), np.inf
        )
        for j in np.flatnonzero((values > allowed).any(0)):
            k = int(np.argmax(values[:, j]))
            by = float(values[k, j] - limit[j])
            found.append(Excess(sampled.names[j], name, by, float(sampled.t[k])))
    return found


def joined(stages: Sequence[Sampled]) -> Sampled:
    """Motions one after the other; a sample at which two meet is kept once, from the second.

    Raises:
        InputValueError: There are none, or they belong to different robots.
    """
    if not stages or len({stage.robot for stage in stages}) > 1:
        raise InputValueError("joined: expected motions of one robot, at least one")
    begin, parts = 0.0, []
    for index, stage in enumerate(stages):
        last = index == len(stages) - 1
        kept = slice(None) if last else slice(0, -1)
        t = stage.t - stage.t[0] + begin
        begin = float(t[-1])
        arrays = (t, stage.q, stage.qd, stage.qdd, stage.T, stage.V, np.full(len(t), index))
        parts.append([array[kept] for array in arrays])
    columns = [np.concatenate(column) for column in zip(*parts, strict=True)]
    return Sampled(stages[0].robot, stages[0].names, *columns)


def _times(duration: float, rate: float) -> FloatArray:
    above_0("sample: rate", rate)
    count = max(round(duration * rate), 1)
    return np.linspace(0, duration, count + 1)


def per_coordinate(name: str, limit: ArrayLike, n: int) -> FloatArray:
    """(n,) limits from a number or n of them.

    Raises:
        ShapeError: They are not.
        InputValueError: One is not above 0.
    """
    values = np.asarray(limit, dtype=np.float64)
    if values.shape not in ((), (n,)):
        raise ShapeError(f"{name} limits: expected a number or ({n},), got shape {values.shape}")
    if not (values > 0).all():
        raise InputValueError(f"{name} limits: expected values above 0, got {values}")
    return np.broadcast_to(values, (n,))
