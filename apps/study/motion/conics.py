"""Conic sections through five points: arcs of ellipses, parabolas and hyperbolas.

A point of the plane has the homogeneous coordinates h = (x, y, 1). A conic consists of the points h
with h^T C h = 0, where C is a symmetric matrix. The pole W of the chord from P to Q is the
intersection of the conic's tangents at P and Q. The arc is

    X(t) = (1 - t)^2 P + 2 t (1 - t) W + t^2 Q,    0 <= t <= 1

The homogeneous coordinates of the pole W are scaled so that W^T C W = -P^T C Q / 2. The sign of W
selects one of the two arcs. For half an ellipse, the pole W is at infinity. The arc length is the
sum of Gauss quadratures on pieces of the arc.

Source:
    G. Farin, Curves and Surfaces for CAGD, chapter 12: conics as rational curves.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.polynomial.legendre import leggauss
from numpy.typing import ArrayLike, NDArray

from chasles import InputValueError, ShapeError
from chasles.summaries import short_repr

from ..tolerances import STRAIGHT
from .curves import CurvePoses, curve_poses, turns_through, waypoints

FloatArray = NDArray[np.float64]

_POINTS = 5
"""Number of points that determine a conic."""
_PIECES, _ORDER = 128, 16
"""Number of pieces of an arc for the computation of its length, and number of quadrature points on
each piece."""
_NEWTON = 4
"""Number of Newton steps that compute the curve parameter t from an arc length."""
_NO_ARC = "conic: the points do not follow each other on an arc of the conic through them"


@dataclass(frozen=True, eq=False)
class ConicArc:
    """An arc of a conic section, from `conic`, parameterized by the arc length s.

    Attributes:
        controls: (3, 4) homogeneous control points P, W and Q: (weight * position [m], weight).
        weight: Weight of the control point W: below 1 for an ellipse, 1 for a parabola, above 1 for
            a hyperbola.
        rotations: Tool orientation as a function of the arc length s.
        table: (k + 1,) arc lengths [m] at k + 1 equally spaced values of the curve parameter t.
        length: Arc length of the whole arc [m].
    """

    controls: FloatArray
    weight: float
    rotations: Any
    table: FloatArray
    length: float

    __repr__ = short_repr

    def at(self, s: FloatArray) -> CurvePoses:
        """Return poses (m, 4, 4), twists V and derivatives A of V at arc lengths s (m,)."""
        p, by_t, by_tt = _point(self.controls, self._parameter(s))
        speed = np.linalg.norm(by_t, axis=1, keepdims=True)
        ahead = by_t / speed
        bend = (by_tt - (by_tt * ahead).sum(1, keepdims=True) * ahead) / speed**2
        return curve_poses(self.rotations, s, p, ahead, bend)

    def _parameter(self, s: FloatArray) -> FloatArray:
        """Return the curve parameters t (m,) at arc lengths s (m,)."""
        pieces = len(self.table) - 1
        t = np.interp(s, self.table, np.linspace(0, 1, pieces + 1))
        for _ in range(_NEWTON):
            k = np.clip((t * pieces).astype(int), 0, pieces - 1)
            missing = s - self.table[k] - _arc_length(self.controls, k / pieces, t)
            t = t + missing / np.linalg.norm(_point(self.controls, t)[1], axis=1)
        return t


def conic(poses: ArrayLike) -> ConicArc:
    """Return the arc of a conic section through five tool poses, from the first to the last.

    Args:
        poses: (5, 4, 4) tool poses in the base frame, or (5, 3) positions of the tool origin [m],
            in the order along the arc. With positions, the tool keeps the orientation of the base
            frame. The positions must be coplanar, and no three of them collinear.

    Returns:
        A `ConicArc`. The orientation changes smoothly through the orientations of the poses.

    Raises:
        ShapeError: `poses` is neither (5, 4, 4) nor (5, 3).
        InputValueError: The positions are not coplanar, three positions are collinear, or the
            positions are not in order along one branch of the conic.
    """
    T, _ = waypoints("conic", poses)
    if len(T) != _POINTS:
        raise ShapeError(f"conic: expected five poses, got {len(T)}")
    p = T[:, :3, 3]
    middle, size, plane = _plane(p)
    points = np.column_stack([(p - middle) @ plane.T / size, np.ones(_POINTS)])
    _require_corners(points)
    controls, t = _arc(points)
    weight = float(controls[1, 2])
    in_space = np.column_stack(
        [size * controls[:, :2] @ plane + controls[:, 2:] * middle, controls[:, 2]]
    )
    ends = np.linspace(0, 1, _PIECES + 1)
    table = np.r_[0, np.cumsum(_arc_length(in_space, ends[:-1], ends[1:]))]
    k = np.clip((t * _PIECES).astype(int), 0, _PIECES - 1)
    s = table[k] + _arc_length(in_space, ends[k], t)
    return ConicArc(in_space, weight, turns_through(T, s), table, float(table[-1]))


def _plane(p: FloatArray) -> tuple[FloatArray, float, FloatArray]:
    """Return (center, size [m], plane axes (2, 3)) of coplanar points."""
    middle = p.mean(0)
    _, spread, axes = np.linalg.svd(p - middle)
    if spread[2] > STRAIGHT * spread[0]:
        raise InputValueError(
            f"conic: expected coplanar points; their distance from a plane is {spread[2]:.3g} m"
        )
    return middle, float(spread[0]), np.asarray(axes[:2])


def _require_corners(points: FloatArray) -> None:
    for i, j, k in itertools.combinations(range(_POINTS), 3):
        a, b = points[j, :2] - points[i, :2], points[k, :2] - points[i, :2]
        area = abs(a[0] * b[1] - a[1] * b[0])
        if area <= STRAIGHT * np.linalg.norm(a) * np.linalg.norm(b):
            raise InputValueError(f"conic: points {i}, {j} and {k} are collinear")


def _arc(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return (control points of the conic arc through five points, parameters t of the points).

    The five points (5, 3) and the control points (3, 3) have homogeneous coordinates.
    """
    x, y, _ = points.T
    terms = np.column_stack([x * x, x * y, y * y, x, y, np.ones(_POINTS)])
    a, b, c, d, e, f = np.linalg.svd(terms)[2][-1]
    C = np.array([[a, b / 2, d / 2], [b / 2, c, e / 2], [d / 2, e / 2, f]])
    start, end = points[0], points[-1]
    pole = np.linalg.solve(C, np.cross(start, end))
    square = -(start @ C @ end) / (2 * pole @ C @ pole)
    if square <= 0:  # the end points are on different branches of a hyperbola
        raise InputValueError(_NO_ARC)
    controls = np.array([start, np.sqrt(square) * pole, end])
    # In the basis of the control points, a point of the arc is k ((1 - t)^2, 2 t (1 - t), t^2),
    # with a factor k.
    before, twice_between, _ = np.linalg.solve(controls.T, points.T)
    if twice_between[1] * before[1] < 0:
        controls[1] *= -1
        twice_between = -twice_between
    odds = twice_between[1:-1] / (2 * before[1:-1])
    t = np.r_[0, odds / (1 + odds), 1]
    if not ((odds > 0).all() and (np.diff(t) > 0).all() and controls[1, 2] > -1):
        raise InputValueError(_NO_ARC)
    return controls, t


def _point(controls: FloatArray, t: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return positions (m, 3) on the arc at t (m,), and their first and second derivatives by t."""
    u = t[:, None]
    first, middle, last = controls
    x = (1 - u) ** 2 * first + 2 * u * (1 - u) * middle + u**2 * last
    x_t = 2 * ((1 - u) * (middle - first) + u * (last - middle))
    x_tt = 2 * (first - 2 * middle + last)
    w, w_t, w_tt = x[:, 3:], x_t[:, 3:], x_tt[3]
    p = x[:, :3] / w
    p_t = (x_t[:, :3] - w_t * p) / w
    return p, p_t, (x_tt[:3] - w_tt * p - 2 * w_t * p_t) / w


def _arc_length(controls: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    """Return arc lengths (m,) [m] from parameters `start` to `end` (m,) on the same piece."""
    nodes, weights = leggauss(_ORDER)
    half, middle = (end - start) / 2, (start + end) / 2
    t = middle[:, None] + half[:, None] * nodes
    speed = np.linalg.norm(_point(controls, t.ravel())[1], axis=1).reshape(t.shape)
    return np.asarray(half * (speed @ weights))
