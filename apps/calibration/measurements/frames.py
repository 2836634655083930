"""Estimate the frames of measuring devices with the nominal robot, to start an identification.

A laser tracker or a camera measures in its device frame W. The target positions in the tool frame
are unknown. At the nominal tool poses T_i, a target at x_j in the tool frame has the measured
positions y_ij = T_W_base (T_i x_j). The measured poses of a probe on the tool are Y_i = T_W_base
T_i T_tool_probe.

Source:
    S. Umeyama, Least-squares estimation of transformation parameters between two point patterns,
    IEEE PAMI 13 (1991), for the rotation.
    M. Shah, Solving the robot-world/hand-eye calibration problem using the Kronecker product, ASME
    Journal of Mechanisms and Robotics 5 (2013), for frames from poses.
"""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

_FIRST_ROUNDS = 5
"""Number of Levenberg-Marquardt steps from each of the 24 start rotations of the base."""
_FINISHED = 6
"""After the first steps from all start rotations of the base, this number of the best rotations is
refined further."""
_ROUNDS = 60
"""Maximum number of steps in the refinement of the best rotations of the base."""
_SETTLED = 1e-6
"""A rotation counts as refined if a step decreases the squared error by at most this fraction."""
_DAMPED = 1e-3
"""Initial Levenberg-Marquardt damping, relative to the trace of the normal equations' matrix."""
_STUCK = 1e6
"""A rotation counts as refined if its damping exceeds this value, relative to the trace of the
normal equations' matrix."""
_FULL = 1e-9
"""Below this relative singular value, an unknown is undetermined."""
_ACROSS = 0.1
"""Joint axes count as parallel if the second singular value of the matrix of their directions is
below this value."""
_LEVER = 0.1
"""Minimum distance from the origin of the points that represent the orientation of a probe [m]. At
this distance, a rotation of the probe by 0.05 mrad moves a point by 5 um."""
_REPEATED = 0.999
"""Maximum ratio of the second largest to the largest singular value for which measured orientations
alone determine the rotations between the frames."""


class Registration(NamedTuple):
    """The base frame and targets estimated from measured positions.

    Attributes:
        T_W_base: (4, 4) the base frame in the device frame W.
        points: (m, 3) positions of the targets in the tool frame [m].
        error: Root mean square distance of the targets from their measured positions [m].
    """

    T_W_base: FloatArray
    points: FloatArray
    error: float


def register_points(T: FloatArray, measured: FloatArray) -> Registration:
    """Return the base frame and target positions that best fit measured target positions.

    Args:
        T: (N, 4, 4) nominal tool poses in the base frame.
        measured: (N, m, 3) positions of m targets in the device frame [m], NaN if invisible.
    """
    registrations = _Registrations(T, measured)
    R = registrations.refined(_CUBE, _FIRST_ROUNDS)
    best = np.linalg.norm(registrations.errors(R), axis=-1).argsort(kind="stable")
    R = registrations.refined(R[best[:_FINISHED]], _ROUNDS)
    return registrations.at(R[np.linalg.norm(registrations.errors(R), axis=-1).argmin()])


def register_poses(T: FloatArray, measured: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the poses of the base in the device frame and of the probe in the tool frame.

    The two poses are the best fit to measured probe poses.

    Args:
        T: (N, 4, 4) nominal tool poses in the base frame.
        measured: (N, 4, 4) probe poses in the device frame.
    """
    R, Y = T[:, :3, :3], measured[:, :3, :3]
    # For each tool orientation R_i and measured probe orientation Y_i, R_base_W = R_i R_tool_probe
    # Y_i^T. The entries of R_tool_probe are therefore proportional to the right singular vector of
    # `products` with the largest singular value.
    products = np.einsum("nij,nkl->ikjl", R, Y).reshape(9, 9)
    _, sizes, vectors = np.linalg.svd(products)
    if sizes[1] > _REPEATED * sizes[0]:
        return _register_by_points(T, measured)
    X = vectors[0].reshape(3, 3)
    R_tool_probe = _rotation(X * np.sign(np.linalg.det(X)))
    R_base_W = _rotation(np.einsum("nij,jk,nlk->il", R, R_tool_probe, Y))
    # The tool origin p_i and the measured probe origin y_i satisfy R_base_W y_i - p_i = R_i
    # t_tool_probe - t_base_W.
    rows = np.concatenate([R, np.broadcast_to(-np.eye(3), R.shape)], -1).reshape(-1, 6)
    right = measured[:, :3, 3] @ R_base_W.T - T[:, :3, 3]
    found = np.linalg.lstsq(rows, right.ravel())[0]
    T_W_base = np.asarray(np.linalg.inv(_pose(R_base_W, found[3:])))
    return T_W_base, _pose(R_tool_probe, found[:3])


def _register_by_points(T: FloatArray, measured: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Estimate the base and probe frames from points, for tool rotations about at most one axis.

    Four points represent the probe: its origin and one point on each coordinate axis. The distance
    of each axis point from the probe origin is the spread of the tool positions, but at least
    `_LEVER`.
    """
    spread = max(float(np.linalg.norm(T[:, :3, 3].std(0))), _LEVER)
    origin, axes = measured[:, None, :3, 3], measured[:, :3, :3].swapaxes(1, 2)
    found = register_points(T, np.concatenate([origin, origin + spread * axes], 1))
    R = _rotation((found.points[1:] - found.points[0]).T)
    return found.T_W_base, _pose(R, found.points[0])


def register_axes(
    nominal: tuple[FloatArray, FloatArray], measured: tuple[FloatArray, FloatArray]
) -> FloatArray | None:
    """Return the base frame that best fits measured joint axes, or None if all axes are parallel.

    Args:
        nominal: Directions (k, 3) and points (k, 3) of the nominal axes in the base frame.
        measured: Directions and points of the measured axes in the device frame.
    """
    (h, p), (n, c) = nominal, measured
    if np.linalg.svd(h)[1][1:2].sum() < _ACROSS:
        return None
    R = _rotation(n.T @ h)
    # For each axis with nominal point p and circle center c, R p + t - c has no component
    # perpendicular to the axis.
    across = np.eye(3) - n[:, :, None] * n[:, None, :]
    right = np.einsum("kij,kj->ki", across, c - p @ R.T)
    return _pose(R, np.linalg.lstsq(across.reshape(-1, 3), right.ravel())[0])


def transformation(points: FloatArray, measured: FloatArray) -> FloatArray:
    """Return the least-squares pose (4, 4) that maps points (N, 3) to measured points (N, 3)."""
    middle, there = points.mean(0), measured.mean(0)
    R = _rotation((measured - there).T @ (points - middle))
    return _pose(R, there - R @ middle)


def targets_at(T: FloatArray, measured: FloatArray) -> FloatArray:
    """Return the mean positions (m, 3) of m targets in the tool frame, from N measurements.

    The tool poses T (N, 4, 4) and the measured target positions (N, m, 3) are in the same frame.
    """
    turned = np.einsum("nji,nmj->nmi", T[:, :3, :3], measured - T[:, None, :3, 3])
    return np.asarray(np.nanmean(turned, axis=0))


def mean_pose(T: FloatArray, measured: FloatArray) -> FloatArray:
    """Return the mean probe pose (4, 4) in the tool frame, from tool and probe poses (N, 4, 4)."""
    R, apart = T[:, :3, :3].swapaxes(-1, -2), measured[:, :3, 3] - T[:, :3, 3]
    return _pose(
        _rotation((R @ measured[:, :3, :3]).sum(0)), (R @ apart[..., None])[..., 0].mean(0)
    )


class _Registrations:
    """Target position errors as a function of the rotation R of the base in the device frame.

    For exact measurements y_ij, the target positions x_j and the translation c satisfy R_i x_j + c
    = R^T y_ij - p_i. The nominal tool pose i has the orientation R_i and the origin p_i.
    """

    def __init__(self, T: FloatArray, measured: FloatArray) -> None:
        """Eliminate target positions x_j and translation c from the least-squares equations.

        The inputs are tool poses T (N, 4, 4) and measured target positions (N, m, 3), which are NaN
        for invisible targets.
        """
        seen = np.isfinite(measured).all(-1)
        index, target = np.nonzero(seen)
        count = len(index)
        rows = np.zeros((count, 3, measured.shape[1] + 1, 3))
        rows[np.arange(count), :, target] = T[index, :3, :3]
        rows[:, :, -1] = np.eye(3)
        # Columns of the right-hand side: coefficients of the entries of R, in the order of
        # R.ravel(), then of the constant -1.
        right = np.einsum("nl,ka->nalk", measured[seen], np.eye(3)).reshape(-1, 9)
        rows = rows.reshape(3 * count, -1)
        everything = np.column_stack([rows, right, T[index, :3, 3].ravel()])
        triangle = np.linalg.qr(everything, mode="r") / np.sqrt(count)
        rows, right = np.split(triangle, [rows.shape[1]], axis=1)
        # A target without observations is placed at the tool origin.
        u, sizes, vt = np.linalg.svd(rows, full_matrices=False)
        rank = int((sizes > _FULL * sizes[0]).sum())
        along = u[:, :rank].T @ right
        self._solution = (vt[:rank].T / sizes[:rank]) @ along
        self._left = right - u[:, :rank] @ along

    def errors(self, R: FloatArray) -> FloatArray:
        """Return the position error vectors (k, r) for k candidate rotations R (k, 3, 3).

        The norm of an error vector is the RMS distance between computed and measured positions.
        """
        return np.asarray(_with_one(R) @ self._left.T)

    def refined(self, R: FloatArray, rounds: int) -> FloatArray:
        """Refine rotations R (k, 3, 3) to local minima of the error, by Levenberg-Marquardt."""
        damping, e = np.full(len(R), _DAMPED), self.errors(R)
        for _ in range(rounds):
            J = (R[:, None] @ _GENERATORS).reshape(-1, 3, 9) @ self._left[:, :9].T
            H = J @ J.swapaxes(1, 2)
            added = damping * (np.trace(H, axis1=1, axis2=2) + np.finfo(float).tiny)
            step = np.linalg.solve(H + added[:, None, None] * np.eye(3), -J @ e[..., None])[..., 0]
            there = R @ _rotated(step)
            after = self.errors(there)
            gain = (e**2).sum(-1) - (after**2).sum(-1)
            less = gain > 0
            is_settled = less & (gain <= _SETTLED * (e**2).sum(-1))
            R = np.where(less[:, None, None], there, R)
            e = np.where(less[:, None], after, e)
            damping = np.where(less, damping / 10, damping * 10)
            if (is_settled | (damping > _STUCK)).all():
                break
        return R

    def at(self, R: FloatArray) -> Registration:
        """Return the best registration for a rotation R (3, 3) of the base in the device frame."""
        found = self._solution @ _with_one(R[None])[0]
        error = float(np.linalg.norm(self.errors(R[None])))
        return Registration(_pose(R, R @ found[-3:]), found[:-3].reshape(-1, 3), error)


def _rotated(step: FloatArray) -> FloatArray:
    """Return rotations (k, 3, 3) by the Cayley transform, a cheap substitute for the exponential.

    For small rotation vectors `step` (k, 3), the Cayley transform and the exponential agree to
    second order.
    """
    half = 0.5 * step
    X = (half @ _GENERATORS.reshape(3, 9)).reshape(-1, 3, 3)
    scale = 2 / (1 + (half**2).sum(-1))
    return np.asarray(np.eye(3) + scale[:, None, None] * (X + X @ X))


def _with_one(R: FloatArray) -> FloatArray:
    """Return vectors (k, 10): the nine entries of each rotation (k, 3, 3), followed by -1."""
    return np.column_stack([R.reshape(-1, 9), np.full(len(R), -1.0)])


def _rotation(matrix: FloatArray) -> FloatArray:
    """Return the rotations R (..., 3, 3) that maximize trace(R^T matrix)."""
    u, _, vt = np.linalg.svd(matrix)
    u[..., 2] *= np.sign(np.linalg.det(u @ vt))[..., None]
    return np.asarray(u @ vt)


def _pose(R: FloatArray, p: FloatArray) -> FloatArray:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, p
    return T


def _cube_rotations() -> list[FloatArray]:
    found = []
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1.0, -1.0), repeat=3):
            matrix = np.zeros((3, 3))
            matrix[range(3), order] = signs
            if np.linalg.det(matrix) > 0:
                found.append(matrix)
    return found


_CUBE = np.array(_cube_rotations())
_GENERATORS = np.array(
    [
        [[0, 0, 0], [0, 0, -1], [0, 1, 0]],
        [[0, 0, 1], [0, 0, 0], [-1, 0, 0]],
        [[0, -1, 0], [1, 0, 0], [0, 0, 0]],
    ],
    dtype=np.float64,
)
"""Cross-product matrices [e_k]x. At w = 0, the derivative of R exp([w]x) with respect to w_k is R
[e_k]x."""
