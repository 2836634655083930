"""Curves: where a tool or the coordinates go, without time.

A curve is a function of the length s from its start. In space s is the way of the tool's origin [m]
or the angle [rad] of a curve that only turns; among coordinates s runs from 0 to 1. With a curve
comes its first and second derivative by s, so that rates and accelerations are exact.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, Protocol, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chasles import InputValueError, ShapeError, so3
from chasles.contract import requires
from chasles.summaries import short_repr

from ..arguments import finite
from ..arguments import poses as rigid
from ..tolerances import IN_PLACE, STRAIGHT

FloatArray = NDArray[np.float64]
Space = Literal["coordinates", "chain"]
Task = Literal["position", "position_pitch", "planar"]


class CurvePoses(NamedTuple):
    """Poses of a tool on a curve.

    Attributes:
        T: (m, 4, 4) poses `T_0_ee`.
        V: (m, 6) mixed twist by s: (dp/ds, turn by s) in base axes.
        A: (m, 6) its derivative by s.
    """

    T: FloatArray
    V: FloatArray
    A: FloatArray


class PoseCurve(Protocol):
    """A curve of the tool.

    Attributes:
        length: Its length [m], or [rad] where the tool only turns.
    """

    length: float

    def at(self, s: FloatArray) -> CurvePoses:
        """Poses at lengths (m,)."""


@dataclass(frozen=True, eq=False)
class JointLine:
    """A straight line in the coordinates: all of them move in proportion.

    Attributes:
        q_start: (n,) values at s = 0.
        q_end: (n,) values at s = length.
        space: "coordinates": the actuated coordinates q; "chain": the joints of the main chain.
        length: The range of s, 1 unless stated.
    """

    q_start: FloatArray
    q_end: FloatArray
    space: Space = "coordinates"
    length: float = 1.0

    __repr__ = short_repr

    def at(self, s: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(m, n) values and their first and second derivatives by s."""
        return _straight(self.q_start, self.q_end, self.length, s)


def joint_line(q_start: ArrayLike, q_end: ArrayLike, *, space: Space = "coordinates") -> JointLine:
    """Return a straight line from one configuration to another.

    Args:
        q_start: (n,) values at the start [rad or m].
        q_end: (n,) values at the end [rad or m].
        space: "coordinates": values of q; "chain": values of the joints of the main chain.

    Raises:
        ShapeError: They are not vectors of the same length.
        InputValueError: A value is not finite.
    """
    a, b = np.asarray(q_start, dtype=np.float64), np.asarray(q_end, dtype=np.float64)
    if a.ndim != 1 or a.shape != b.shape:
        raise ShapeError(f"joint_line: expected two vectors (n,), got {a.shape} and {b.shape}")
    return JointLine(finite("joint_line: q_start", a), finite("joint_line: q_end", b), space)


@dataclass(frozen=True, eq=False)
class TaskLine:
    """A straight line in the coordinates of a task, such as position and pitch.

    Attributes:
        start: (k,) task coordinates at the start, as the robot's inverse of the task takes them.
        end: (k,) task coordinates at the end.
        task: "position", "position_pitch" or "planar".
        length: The distance of the positions [m]; of a line without one, that of all coordinates.
    """

    start: FloatArray
    end: FloatArray
    task: Task
    length: float

    __repr__ = short_repr

    def at(self, s: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(m, k) values and their first and second derivatives by s."""
        return _straight(self.start, self.end, self.length, s)


def task_line(task: Task, start: ArrayLike, end: ArrayLike) -> TaskLine:
    """A straight line in the coordinates of a task.

    Args:
        task: "position" (x, y, z), "position_pitch" (and the elevation of the tool's third axis
            above the base's x-y plane) or "planar" (x, y and the angle in the base's x-y plane).
        start: (k,) task coordinates at the start [m, rad].
        end: (k,) task coordinates at the end [m, rad].

    Raises:
        ShapeError: They are not k values.
        InputValueError: The task is unknown, a value is not finite, or both ends are the same.
    """
    _require_task("task_line", task)
    a, b = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
    count = 4 if task == "position_pitch" else 3
    if a.shape != (count,) or b.shape != (count,):
        raise ShapeError(f"task_line: {task} has {count} values, got {a.shape} and {b.shape}")
    places = 2 if task == "planar" else 3
    way = _way(finite("task_line: start", a)[:places], finite("task_line: end", b)[:places])
    length = float(np.linalg.norm(way)) or float(np.linalg.norm((b - a)[places:]))
    _require_way("task_line", length)
    return TaskLine(a, np.r_[a[:places] + way, b[places:]], task, length)


@dataclass(frozen=True, eq=False)
class TaskCurve:
    """A curve of the tool's origin in the coordinates of a task.

    Attributes:
        curve: The curve; its orientation does not count.
        start: Pitch or angle at its start [rad].
        end: Pitch or angle at its end [rad]; on the way it changes in proportion to s.
        task: "position", "position_pitch" or "planar".
        length: Its length [m].
    """

    curve: PoseCurve
    start: float
    end: float
    task: Task
    length: float

    __repr__ = short_repr

    def at(self, s: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(m, k) values and their first and second derivatives by s."""
        T, V, A = self.curve.at(s)
        places = 2 if self.task == "planar" else 3
        orders = [T[:, :places, 3], V[:, :places], A[:, :places]]
        if self.task != "position":
            slope = (self.end - self.start) / self.length
            angle = (self.start + slope * s, np.full(len(s), slope), np.zeros(len(s)))
            orders = [np.column_stack(pair) for pair in zip(orders, angle, strict=True)]
        return orders[0], orders[1], orders[2]


def task_curve(task: Task, curve: PoseCurve, start: float = 0.0, end: float = 0.0) -> TaskCurve:
    """A curve of the tool's origin for an arm that cannot hold every orientation.

    Args:
        task: "position", "position_pitch" or "planar", as in `task_line`.
        curve: The curve of the origin, of which the position counts.
        start: Pitch or angle at the start [rad].
        end: Pitch or angle at the end [rad]; on the way it changes in proportion to s.

    Raises:
        InputValueError: The task is unknown, or an angle is not finite.
    """
    _require_task("task_curve", task)
    first, last = finite("task_curve: start and end", [start, end])
    return TaskCurve(curve, float(first), float(last), task, curve.length)


def _require_task(name: str, task: str) -> None:
    if task not in get_args(Task):
        raise InputValueError(f"{name}: expected one of {', '.join(get_args(Task))}, got {task!r}")


@dataclass(frozen=True, eq=False)
class _Turning:
    """The orientation along a curve: about one axis, in proportion to s."""

    R_0: FloatArray
    turn: FloatArray
    length: float

    __repr__ = short_repr

    def at(self, s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Rotations (m, 3, 3) and the turn by s (3,) in base axes."""
        rate = self.turn / self.length if self.length else np.zeros(3)
        return self.R_0 @ so3.exp(s[:, None] * rate), self.R_0 @ rate


@dataclass(frozen=True, eq=False)
class Line:
    """A straight line; the tool turns about one axis on the way."""

    start: FloatArray
    step: FloatArray
    turning: _Turning
    length: float

    __repr__ = short_repr

    def at(self, s: FloatArray) -> CurvePoses:
        """Poses at lengths (m,)."""
        R, turn = self.turning.at(s)
        along = self.step / self.length if self.length else np.zeros(3)
        V = np.broadcast_to(np.r_[along, turn], (len(s), 6))
        return CurvePoses(poses_at(R, self.start + s[:, None] * along), V, np.zeros(V.shape))


@dataclass(frozen=True, eq=False)
class Arc:
    """A circular arc; the tool turns about one axis on the way."""

    center: FloatArray
    axes: FloatArray
    radius: float
    turning: _Turning
    length: float

    __repr__ = short_repr

    def at(self, s: FloatArray) -> CurvePoses:
        """Poses at lengths (m,)."""
        angle = s / self.radius
        R, turn = self.turning.at(s)
        u, v = self.axes
        out = np.cos(angle)[:, None] * u + np.sin(angle)[:, None] * v
        ahead = np.cos(angle)[:, None] * v - np.sin(angle)[:, None] * u
        V = np.hstack([ahead, np.broadcast_to(turn, ahead.shape)])
        A = np.hstack([-out / self.radius, np.zeros(out.shape)])
        return CurvePoses(poses_at(R, self.center + self.radius * out), V, A)


def line(T_start: ArrayLike, T_end: ArrayLike) -> Line:
    """A straight line of the tool's origin; the tool turns about one axis on the way.

    Args:
        T_start: (4, 4) pose at the start.
        T_end: (4, 4) pose at the end. For a half turn the axis is one of two.

    Returns:
        The line; where the tool only turns, its length is the angle [rad].

    Raises:
        ShapeError: A pose is not (4, 4).
        InputValueError: A pose is not rigid or not finite, or both are the same.
    """
    a, b = _pose("line: T_start", T_start), _pose("line: T_end", T_end)
    step, turn = _way(a[:3, 3], b[:3, 3]), so3.log(a[:3, :3].T @ b[:3, :3])
    length = float(np.linalg.norm(step)) or float(np.linalg.norm(turn))
    _require_way("line", length)
    return Line(a[:3, 3], step, _Turning(a[:3, :3], turn, length), length)


def arc(T_start: ArrayLike, via: ArrayLike, T_end: ArrayLike) -> Arc:
    """The circular arc from a pose to another through a point.

    Args:
        T_start: (4, 4) pose at the start.
        via: (3,) point on the arc between both [m].
        T_end: (4, 4) pose at the end; the tool turns about one axis on the way.

    Raises:
        InputValueError: The points lie on a line or are the same, a number is not finite, or a pose
            is not rigid.
        ShapeError: A pose is not (4, 4), or the point not (3,).
    """
    a, b = _pose("arc: T_start", T_start), _pose("arc: T_end", T_end)
    p, m, e = a[:3, 3], finite("arc: via", via, (3,)), b[:3, 3]
    if not _way(p, e).any():
        raise InputValueError("arc: it ends where it starts; a circle is made of two arcs")
    if not (_way(p, m).any() and _way(m, e).any()):
        raise InputValueError("arc: via is at the start or at the end; take `line`, or another via")
    chord, other = e - p, m - p
    normal = np.cross(other, chord)
    area = np.linalg.norm(normal)
    if area <= STRAIGHT * np.linalg.norm(other) * np.linalg.norm(chord):
        raise InputValueError("arc: start, via and end lie on a line; take `line`")
    normal /= area
    to_centre = (
        np.cross(normal, other) * (chord @ chord) - np.cross(normal, chord) * (other @ other)
    ) / (2 * area)
    center, radius = p + to_centre, float(np.linalg.norm(to_centre))
    u = -to_centre / radius
    v = np.cross(normal, u)
    angle = math.atan2((e - center) @ v, (e - center) @ u) % (2 * math.pi)
    length = radius * angle
    turn = so3.log(a[:3, :3].T @ b[:3, :3])
    return Arc(center, np.array([u, v]), radius, _Turning(a[:3, :3], turn, length), length)


def _straight(
    start: FloatArray, end: FloatArray, length: float, s: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Values (m, n) on a straight line, and their first and second derivatives by s."""
    by_s = (end - start) / (length or 1.0)
    values = start + s[:, None] * by_s
    return values, np.broadcast_to(by_s, values.shape), np.zeros(values.shape)


def poses_at(R: FloatArray, p: FloatArray) -> FloatArray:
    """Poses (m, 4, 4) with rotations (m, 3, 3) at positions (m, 3)."""
    T = np.zeros((len(p), 4, 4))
    T[:, :3, :3], T[:, :3, 3], T[:, 3, 3] = R, p, 1
    return T


def _pose(name: str, T: ArrayLike) -> FloatArray:
    pose = np.asarray(T, dtype=np.float64)
    if pose.shape != (4, 4):
        raise ShapeError(f"{name}: expected a pose (4, 4), got shape {pose.shape}")
    return rigid(name, pose)


def _way(a: FloatArray, b: FloatArray) -> FloatArray:
    """The way from one position to another [m]; 0 where it is no more than rounding."""
    step = b - a
    size = max(1.0, float(np.abs(a).max()))
    return step if np.linalg.norm(step) > IN_PLACE * size else np.zeros(step.shape)


def _require_way(name: str, length: float) -> None:
    if not length > IN_PLACE:
        raise InputValueError(
            f"{name}: start and end are the same, so that nothing moves; "
            "`MotionSequence.pause` waits"
        )


@dataclass(frozen=True, eq=False)
class Spline:
    """A curve through poses, or past their corners; s is the sum of the chords between them."""

    positions: Any
    rotations: Any
    length: float

    __repr__ = short_repr

    def at(self, s: FloatArray) -> CurvePoses:
        """Poses at lengths (m,)."""
        p, v, a = (self.positions(s, order) for order in range(3))
        R = self.rotations(s).as_matrix()
        # SciPy gives the turn in body axes; its derivative needs no further term in base axes,
        # since omega x omega = 0.
        turn, turn_rate = ((R @ self.rotations(s, order)[..., None])[..., 0] for order in (1, 2))
        return CurvePoses(poses_at(R, p), np.hstack([v, turn]), np.hstack([a, turn_rate]))


def spline(poses: ArrayLike) -> Spline:
    """A smooth curve through poses: cubic splines of position and orientation.

    Args:
        poses: (m, 4, 4) poses, at least three, which differ in position from the one before; or
            (m, 3) positions [m] with the orientation of the base.

    Raises:
        ShapeError: These are not three poses or more.
        InputValueError: Two successive poses have the same position.
    """
    with requires("chasles[study]"):
        from scipy.interpolate import CubicSpline  # noqa: PLC0415

    T, s = waypoints("spline", poses)
    return Spline(CubicSpline(s, T[:, :3, 3]), turns_through(T, s), float(s[-1]))


def parabola(poses: ArrayLike) -> Spline:
    """The parabola through three poses, whose parameter is the sum of the chords between them.

    Args:
        poses: (3, 4, 4) poses, which differ in position; or (3, 3) positions [m] with the
            orientation of the base.

    Raises:
        ShapeError: These are not three poses.
        InputValueError: Two successive poses have the same position.
    """
    with requires("chasles[study]"):
        from scipy.interpolate import PPoly  # noqa: PLC0415

    T, s = waypoints("parabola", poses)
    if len(T) != 3:  # noqa: PLR2004 - three points determine a parabola
        raise ShapeError(f"parabola: expected three poses, got {len(T)}")
    p = T[:, :3, 3]
    first, second = (p[1] - p[0]) / s[1], (p[2] - p[1]) / (s[2] - s[1])
    bend = (second - first) / s[2]
    rows = np.array([bend, first - bend * s[1], p[0]])
    return Spline(PPoly(rows[:, None], s[[0, -1]]), turns_through(T, s), float(s[-1]))


def blend(poses: ArrayLike, radius: float) -> Spline:
    """Straight lines between poses, whose corners are cut off by parabolas.

    The tool leaves a line at a distance from the corner and joins the next one at the same distance
    behind it; its direction is continuous, its curvature jumps. It passes the corner within half
    the distance, and all orientations are met at the corners.

    Args:
        poses: (m, 4, 4) poses, at least three, which differ in position from the one before; or
            (m, 3) positions [m] with the orientation of the base.
        radius: The distance from each corner [m], at most half of the lines beside it.

    Raises:
        ShapeError: These are not three poses or more.
        InputValueError: Two successive poses have the same position, or the radius does not fit.
    """
    with requires("chasles[study]"):
        from scipy.interpolate import PPoly  # noqa: PLC0415

    T, s = waypoints("blend", poses)
    p, chords = T[:, :3, 3], np.diff(s)
    if not 0 < radius <= chords.min() / 2:
        raise InputValueError(
            f"blend: expected a radius above 0, at most {chords.min() / 2:.6g} m, got {radius:g}"
        )
    along = np.diff(p, axis=0) / chords[:, None]
    breaks, rows = [0.0], []
    for k, direction in enumerate(along):
        rows.append([np.zeros(3), direction, p[k] + (breaks[-1] - s[k]) * direction])
        last = k == len(along) - 1
        breaks.append(s[k + 1] - (0 if last else radius))
        if not last:
            bend = (along[k + 1] - direction) / (4 * radius)
            rows.append([bend, direction, p[k + 1] - radius * direction])
            breaks.append(s[k + 1] + radius)
    coefficients = np.array(rows).transpose(1, 0, 2)
    return Spline(PPoly(coefficients, np.array(breaks)), turns_through(T, s), float(s[-1]))


def waypoints(name: str, poses: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Poses (m, 4, 4) on a curve, and the sums of the chords before them (m,).

    Args:
        name: The function that was called, for errors.
        poses: (m, 4, 4) poses or (m, 3) positions, at least three; successive ones differ.

    Raises:
        ShapeError: These are not three poses or more.
        InputValueError: Two successive poses have the same position, a number is not finite, or a
            pose is not rigid.
    """
    T = np.asarray(poses, dtype=np.float64)
    if T.ndim == 2 and T.shape[1] == 3:  # noqa: PLR2004 - rows of positions
        T = poses_at(np.broadcast_to(np.eye(3), (len(T), 3, 3)), T)
    if T.ndim != 3 or T.shape[1:] != (4, 4) or len(T) < 3:  # noqa: PLR2004 - rows of matrices
        raise ShapeError(
            f"{name}: expected three poses (m, 4, 4) or more, or positions, got {T.shape}"
        )
    T = rigid(f"{name}: poses", T)
    chords = np.linalg.norm(np.diff(T[:, :3, 3], axis=0), axis=1)
    if not (chords > IN_PLACE * max(1.0, float(np.abs(T[:, :3, 3]).max()))).all():
        k = int(np.argmin(chords))
        raise InputValueError(f"{name}: poses {k} and {k + 1} have the same position")
    return T, np.r_[0, np.cumsum(chords)]


def turns_through(T: FloatArray, s: FloatArray) -> Any:
    """The smooth orientation through those of poses (m, 4, 4), as a function of s."""
    with requires("chasles[study]"):
        from scipy.spatial.transform import Rotation, RotationSpline  # noqa: PLC0415

    return RotationSpline(s, Rotation.from_matrix(T[:, :3, :3]))
