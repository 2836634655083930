"""Curves of tool poses or of coordinates, without time.

A curve is a function of the length s from its start. For tool curves, s is the path length of the
tool origin [m], or the angle [rad] of a pure rotation. For curves of the coordinates, s increases
from 0 to 1. All derivatives of a curve with respect to s are exact, and so are rates and
accelerations.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chasles import InputValueError, ShapeError, so3
from chasles.contract import requires
from chasles.summaries import short_repr

from ..arguments import finite, pose, real
from ..arguments import poses as rigid
from ..tolerances import IN_PLACE, STRAIGHT

FloatArray = NDArray[np.float64]
Space = Literal["coordinates", "chain"]


class CurvePoses(NamedTuple):
    """Tool poses at points of a curve, with twists and their derivatives along the curve.

    Attributes:
        T: (m, 4, 4) tool poses `T_0_ee` in the base frame.
        V: (m, 6) mixed twists of the tool per unit of the curve length s, in base axes.
        A: (m, 6) derivatives of the twists V with respect to s.
    """

    T: FloatArray
    V: FloatArray
    A: FloatArray


class PoseCurve(Protocol):
    """A curve of tool poses, such as a curve from `line`, `arc`, `spline` or `conic`.

    Attributes:
        length: Length of the curve [m], or [rad] for a pure rotation.
    """

    length: float

    def at(self, s: FloatArray) -> CurvePoses:
        """Return poses (m, 4, 4), twists V and derivatives A of V at curve lengths s (m,)."""


@dataclass(frozen=True, eq=False)
class JointLine:
    """A straight line in the joint space, from `joint_line`, linear in the path parameter s.

    Attributes:
        q_start: (n,) coordinates or joint positions at s = 0 [rad or m].
        q_end: (n,) coordinates or joint positions at s = `length` [rad or m].
        space: "coordinates" for values of the actuated coordinates, "chain" for joint positions of
            the main chain.
        length: The value of the path parameter s at the end of the line, by default 1.
    """

    q_start: FloatArray
    q_end: FloatArray
    space: Space = "coordinates"
    length: float = 1.0

    __repr__ = short_repr

    def at(self, s: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return values (m, n) on the line at s (m,), and first and second derivatives by s."""
        return straight_line(self.q_start, self.q_end, self.length, s)


def joint_line(q_start: ArrayLike, q_end: ArrayLike, *, space: Space = "coordinates") -> JointLine:
    """Return a straight line in the joint space from one configuration to another.

    Args:
        q_start: (n,) values at the start [rad or m], in the coordinates that `space` selects.
        q_end: (n,) values at the end [rad or m].
        space: "coordinates" for a line in the actuated coordinates. "chain" for a line in the joint
            positions of the main chain from the base to the tool. For robots without loops, both
            values of `space` give the same line.

    Raises:
        ShapeError: `q_start` and `q_end` are not vectors of equal length.
        InputValueError: A value is not finite.
    """
    a, b = real("joint_line: q_start", q_start), real("joint_line: q_end", q_end)
    if a.ndim != 1 or a.shape != b.shape:
        raise ShapeError(f"joint_line: expected two vectors (n,), got {a.shape} and {b.shape}")
    return JointLine(finite("joint_line: q_start", a), finite("joint_line: q_end", b), space)


@dataclass(frozen=True, eq=False)
class _Turning:
    """Orientation along a curve, with a rotation angle about one axis that is proportional to s."""

    R_0: FloatArray
    turn: FloatArray
    length: float

    __repr__ = short_repr

    def at(self, s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return (rotations (m, 3, 3), angular velocity (3,) per unit of s in base axes)."""
        rate = self.turn / self.length if self.length else np.zeros(3)
        return self.R_0 @ so3.exp(s[:, None] * rate), self.R_0 @ rate


@dataclass(frozen=True, eq=False)
class Line:
    """A straight line of the tool origin, from `line`. The tool rotates about one fixed axis."""

    start: FloatArray
    step: FloatArray
    turning: _Turning
    length: float

    __repr__ = short_repr

    def at(self, s: FloatArray) -> CurvePoses:
        """Return poses (m, 4, 4), twists V and derivatives A of V at curve lengths s (m,)."""
        R, turn = self.turning.at(s)
        along = self.step / self.length if self.length else np.zeros(3)
        V = np.broadcast_to(np.r_[along, turn], (len(s), 6))
        return CurvePoses(poses_at(R, self.start + s[:, None] * along), V, np.zeros(V.shape))


@dataclass(frozen=True, eq=False)
class Arc:
    """A circular arc of the tool origin, from `arc`. The tool rotates about one fixed axis."""

    center: FloatArray
    axes: FloatArray
    radius: float
    turning: _Turning
    length: float

    __repr__ = short_repr

    def at(self, s: FloatArray) -> CurvePoses:
        """Return poses (m, 4, 4), twists V and derivatives A of V at curve lengths s (m,)."""
        angle = s / self.radius
        R, turn = self.turning.at(s)
        u, v = self.axes
        out = np.cos(angle)[:, None] * u + np.sin(angle)[:, None] * v
        ahead = np.cos(angle)[:, None] * v - np.sin(angle)[:, None] * u
        V = np.hstack([ahead, np.broadcast_to(turn, ahead.shape)])
        A = np.hstack([-out / self.radius, np.zeros(out.shape)])
        return CurvePoses(poses_at(R, self.center + self.radius * out), V, A)


def line(T_start: ArrayLike, T_end: ArrayLike) -> Line:
    """Return a straight line of the tool origin, with a rotation of the tool about one fixed axis.

    Args:
        T_start: (4, 4) tool pose at the start, in the base frame, with its position in [m].
        T_end: (4, 4) tool pose at the end. For a rotation by half a turn, the sense of rotation is
            ambiguous.

    Returns:
        A `Line`. Its `length` is the distance of the positions [m], or the angle [rad] of a pure
        rotation.

    Raises:
        ShapeError: `T_start` or `T_end` is not (4, 4).
        InputValueError: A pose is not a rigid transformation or not finite, or both poses are
            equal.
    """
    a, b = pose("line: T_start", T_start), pose("line: T_end", T_end)
    step, turn = displacement(a[:3, 3], b[:3, 3]), so3.log(a[:3, :3].T @ b[:3, :3])
    length = float(np.linalg.norm(step)) or float(np.linalg.norm(turn))
    require_long("line", length)
    return Line(a[:3, 3], step, _Turning(a[:3, :3], turn, length), length)


def arc(T_start: ArrayLike, via: ArrayLike, T_end: ArrayLike) -> Arc:
    """Return the circular arc of the tool origin from a pose through a point to another pose.

    Args:
        T_start: (4, 4) tool pose at the start, in the base frame, with its position in [m].
        via: (3,) point on the arc between start and end, in the base frame [m].
        T_end: (4, 4) tool pose at the end. Between both poses, the tool rotates about one fixed
            axis.

    Raises:
        InputValueError: The three points are collinear, or two of them are equal. A number is not
            finite, or a pose is not a rigid transformation.
        ShapeError: `T_start` or `T_end` is not (4, 4), or `via` is not (3,).
    """
    a, b = pose("arc: T_start", T_start), pose("arc: T_end", T_end)
    p, m, e = a[:3, 3], finite("arc: via", via, (3,)), b[:3, 3]
    if not displacement(p, e).any():
        raise InputValueError("arc: start and end are equal; combine two arcs for a circle")
    if not (displacement(p, m).any() and displacement(m, e).any()):
        raise InputValueError("arc: via is at the start or the end; use `line`, or another via")
    chord, other = e - p, m - p
    normal = np.cross(other, chord)
    area = np.linalg.norm(normal)
    if area <= STRAIGHT * np.linalg.norm(other) * np.linalg.norm(chord):
        raise InputValueError("arc: start, via and end are collinear; use `line`")
    normal /= area
    to_center = (
        np.cross(normal, other) * (chord @ chord) - np.cross(normal, chord) * (other @ other)
    ) / (2 * area)
    center, radius = p + to_center, float(np.linalg.norm(to_center))
    u = -to_center / radius
    v = np.cross(normal, u)
    angle = math.atan2((e - center) @ v, (e - center) @ u) % (2 * math.pi)
    length = radius * angle
    turn = so3.log(a[:3, :3].T @ b[:3, :3])
    return Arc(center, np.array([u, v]), radius, _Turning(a[:3, :3], turn, length), length)


def straight_line(
    start: FloatArray, end: FloatArray, length: float, s: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return values (m, n) at s (m,) on a straight line, and first and second derivatives by s."""
    by_s = (end - start) / (length or 1.0)
    values = start + s[:, None] * by_s
    return values, np.broadcast_to(by_s, values.shape), np.zeros(values.shape)


def poses_at(R: FloatArray, p: FloatArray) -> FloatArray:
    """Return poses (m, 4, 4) with rotations (m, 3, 3) and positions (m, 3)."""
    T = np.zeros((len(p), 4, 4))
    T[:, :3, :3], T[:, :3, 3], T[:, 3, 3] = R, p, 1
    return T


def displacement(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the displacement from ``a`` to ``b`` [m], or 0 if it is only a rounding error."""
    step = b - a
    size = max(1.0, float(np.abs(a).max()))
    return step if np.linalg.norm(step) > IN_PLACE * size else np.zeros(step.shape)


def require_long(name: str, length: float) -> None:
    """Raise an error if a curve has no length."""
    if not length > IN_PLACE:
        raise InputValueError(
            f"{name}: start and end are equal, so nothing moves; use `MotionSequence.pause` to wait"
        )


@dataclass(frozen=True, eq=False)
class Spline:
    """A smooth curve of tool poses.

    The curve parameter s is the length along the chords between the waypoints.
    """

    positions: Any
    rotations: Any
    length: float

    __repr__ = short_repr

    def at(self, s: FloatArray) -> CurvePoses:
        """Return poses (m, 4, 4), twists V and derivatives A of V at curve lengths s (m,)."""
        p, v, a = (self.positions(s, order) for order in range(3))
        return curve_poses(self.rotations, s, p, v, a)


def curve_poses(
    rotations: Any, s: FloatArray, p: FloatArray, v: FloatArray, a: FloatArray
) -> CurvePoses:
    """Return the poses at lengths s (m,) from positions p and their derivatives v and a."""
    R = rotations(s).as_matrix()
    # SciPy returns the angular velocity in body axes. The derivative of the angular velocity
    # transforms to base axes without an additional term, because omega x omega = 0.
    turn, turn_rate = ((R @ rotations(s, order)[..., None])[..., 0] for order in (1, 2))
    return CurvePoses(poses_at(R, p), np.hstack([v, turn]), np.hstack([a, turn_rate]))


def spline(poses: ArrayLike) -> Spline:
    """Return a smooth curve (cubic spline) through tool poses.

    Args:
        poses: (m, 4, 4) three or more tool poses in the base frame, or (m, 3) positions of the tool
            origin [m]. With positions, the tool keeps the orientation of the base frame.
            Consecutive positions must differ.

    Raises:
        ShapeError: `poses` is neither (m, 4, 4) nor (m, 3), or m is less than 3.
        InputValueError: Two consecutive poses have the same position.
    """
    with requires("chasles[study]"):
        from scipy.interpolate import CubicSpline  # noqa: PLC0415

    T, s = waypoints("spline", poses)
    return Spline(CubicSpline(s, T[:, :3, 3]), turns_through(T, s), float(s[-1]))


def parabola(poses: ArrayLike) -> Spline:
    """Return a parabola through three tool poses.

    Args:
        poses: (3, 4, 4) tool poses in the base frame, or (3, 3) positions of the tool origin [m].
            With positions, the tool keeps the orientation of the base frame. Consecutive positions
            must differ.

    Raises:
        ShapeError: `poses` is neither (3, 4, 4) nor (3, 3).
        InputValueError: Two consecutive poses have the same position.
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
    """Return straight lines between tool poses, with corners that are rounded by parabolas.

    The direction of the curve is continuous, but its curvature is not. The distance of the curve
    from each corner is at most half of `radius`. Nearest to a corner, the tool has the orientation
    of the corner pose.

    Args:
        poses: (m, 4, 4) three or more tool poses in the base frame, or (m, 3) positions of the tool
            origin [m]. With positions, the tool keeps the orientation of the base frame.
            Consecutive positions must differ.
        radius: Distance from each corner to the start and the end of its parabola [m], above 0. The
            radius is at most half the shortest distance between consecutive positions.

    Raises:
        ShapeError: `poses` is neither (m, 4, 4) nor (m, 3), or m is less than 3.
        InputValueError: Two consecutive poses have the same position, or `radius` is not above 0 or
            too large.
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
    """Return (poses (m, 4, 4), lengths (m,) from the start along the chords between the poses).

    Args:
        name: Name of the calling function, for error messages.
        poses: three or more poses (m, 4, 4) or positions (m, 3). Consecutive positions differ.

    Raises:
        ShapeError: `poses` is neither (m, 4, 4) nor (m, 3), or m is less than 3.
        InputValueError: Two consecutive poses have the same position, a number is not finite, or a
            pose is not rigid.
    """
    T = real(f"{name}: poses", poses)
    if T.ndim == 2 and T.shape[1] == 3:  # noqa: PLR2004 - each row is a position
        T = poses_at(np.broadcast_to(np.eye(3), (len(T), 3, 3)), T)
    if T.ndim != 3 or T.shape[1:] != (4, 4) or len(T) < 3:  # noqa: PLR2004 - each row is a pose
        raise ShapeError(
            f"{name}: expected three or more poses (m, 4, 4) or positions (m, 3), got {T.shape}"
        )
    T = rigid(f"{name}: poses", T)
    chords = np.linalg.norm(np.diff(T[:, :3, 3], axis=0), axis=1)
    if not (chords > IN_PLACE * max(1.0, float(np.abs(T[:, :3, 3]).max()))).all():
        k = int(np.argmin(chords))
        raise InputValueError(f"{name}: two poses have the same position: {k} and {k + 1}")
    return T, np.r_[0, np.cumsum(chords)]


def turns_through(T: FloatArray, s: FloatArray) -> Any:
    """Return a smooth orientation curve through the poses (m, 4, 4), as a function of s."""
    with requires("chasles[study]"):
        from scipy.spatial.transform import Rotation, RotationSpline  # noqa: PLC0415

    return RotationSpline(s, Rotation.from_matrix(T[:, :3, :3]))
