"""Frames of measuring devices in closed form, from the nominal robot: starts of an identification.

A laser tracker or a camera measures in a frame W of its own, and the place of its targets on the
tool is unknown. With the nominal poses T_i of the tool in the base frame,

    y_ij = T_W_base (T_i x_j)         positions of targets x_j
    Y_i  = T_W_base T_i T_tool_probe  poses of a probe

Source:
    S. Umeyama, Least-squares estimation of transformation parameters between two point patterns,
    IEEE PAMI 13 (1991), for the rotation; M. Shah, Solving the robot-world/hand-eye calibration
    problem using the Kronecker product, ASME J. Mechanisms and Robotics 5 (2013), for poses.
"""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

_FIRST_ROUNDS = 4
"""Alternations from each of 24 rotations; those with the least error go on."""
_FINISHED = 6
"""Rotations that go on."""
_ROUNDS = 100
"""Alternations from these; the best is refined by the identification."""
_ACROSS = 0.1
"""Second singular value of directions below which axes are parallel and leave a turn open."""
_LEVER = 0.1
"""Least distance of points that stand for an orientation [m]: 0.05 mrad weigh 5 um there."""
_REPEATED = 0.999
"""Second singular value, in parts of the first, from which orientations leave the frames open."""
_SETTLED = 0.9999
"""Part of the error that is left by an alternation behind which no more follow."""


class Registration(NamedTuple):
    """Frames found from measurements.

    Attributes:
        T_W_base: (4, 4) the base frame in the measuring device's.
        points: (m, 3) targets in the tool's frame [m].
        error: Root mean square distance [m].
    """

    T_W_base: FloatArray
    points: FloatArray
    error: float


def register_points(T: FloatArray, measured: FloatArray) -> Registration:
    """The base frame and the targets that fit measured positions best.

    Args:
        T: (N, 4, 4) nominal poses of the tool in the base frame.
        measured: (N, m, 3) positions of m targets in the device's frame [m], NaN where a target was
            not seen.
    """
    alternation = _Alternation(T, measured)
    screened = alternation.from_rotations(_CUBE, _FIRST_ROUNDS)
    best = np.argsort(screened.error, kind="stable")[:_FINISHED]
    finished = alternation.from_rotations(screened.R[best], _ROUNDS)
    k = int(np.argmin(finished.error))
    frame = _pose(finished.R[k], finished.shift[k])
    return Registration(frame, finished.points[k], float(finished.error[k]))


def register_poses(T: FloatArray, measured: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The frames T_W_base and T_tool_probe that fit measured poses best.

    Args:
        T: (N, 4, 4) nominal poses of the tool in the base frame.
        measured: (N, 4, 4) poses of the probe in the device's frame.
    """
    R, Y = T[:, :3, :3], measured[:, :3, :3]
    # R_base_W = R_i R_tool_probe Y_i^T for all i: the largest singular value's pair of vectors.
    products = np.einsum("nij,nkl->ikjl", R, Y).reshape(9, 9)
    _, sizes, vectors = np.linalg.svd(products)
    if sizes[1] > _REPEATED * sizes[0]:
        return _register_by_points(T, measured)
    X = vectors[0].reshape(3, 3)
    R_tool_probe = _rotation(X * np.sign(np.linalg.det(X)))
    R_base_W = _rotation(np.einsum("nij,jk,nlk->il", R, R_tool_probe, Y))
    # R_base_W y_i - p_i = R_i t_tool_probe - t_base_W
    rows = np.concatenate([R, np.broadcast_to(-np.eye(3), R.shape)], -1).reshape(-1, 6)
    right = measured[:, :3, 3] @ R_base_W.T - T[:, :3, 3]
    found = np.linalg.lstsq(rows, right.ravel())[0]
    T_W_base = np.asarray(np.linalg.inv(_pose(R_base_W, found[3:])))
    return T_W_base, _pose(R_tool_probe, found[:3])


def _register_by_points(T: FloatArray, measured: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The frames of tools that turn about one axis or not at all, whose places count as well.

    The probe is four points: its origin, and one on each axis as far away as the tool moves, or
    `_LEVER` where it hardly moves.
    """
    spread = max(float(np.linalg.norm(T[:, :3, 3].std(0))), _LEVER)
    origin, axes = measured[:, None, :3, 3], measured[:, :3, :3].swapaxes(1, 2)
    found = register_points(T, np.concatenate([origin, origin + spread * axes], 1))
    R = _rotation((found.points[1:] - found.points[0]).T)
    return found.T_W_base, _pose(R, found.points[0])


def register_axes(
    nominal: tuple[FloatArray, FloatArray], measured: tuple[FloatArray, FloatArray]
) -> FloatArray | None:
    """The base frame that carries nominal axes nearest to measured ones; None if they are parallel.

    Args:
        nominal: Directions (k, 3) and points (k, 3) in the base frame.
        measured: Directions and points in the device's frame.
    """
    (h, p), (n, c) = nominal, measured
    if np.linalg.svd(h)[1][1:2].sum() < _ACROSS:
        return None
    R = _rotation(n.T @ h)
    # The part of R p + t - c across the axis vanishes.
    across = np.eye(3) - n[:, :, None] * n[:, None, :]
    right = np.einsum("kij,kj->ki", across, c - p @ R.T)
    return _pose(R, np.linalg.lstsq(across.reshape(-1, 3), right.ravel())[0])


def transformation(points: FloatArray, measured: FloatArray) -> FloatArray:
    """(4, 4) the pose that carries points (N, 3) nearest to measured ones (N, 3)."""
    middle, there = points.mean(0), measured.mean(0)
    R = _rotation((measured - there).T @ (points - middle))
    return _pose(R, there - R @ middle)


def targets_at(T: FloatArray, measured: FloatArray) -> FloatArray:
    """(m, 3) mean places of targets on the tool, from poses (N, 4, 4) and positions (N, m, 3)."""
    turned = np.einsum("nji,nmj->nmi", T[:, :3, :3], measured - T[:, None, :3, 3])
    return np.asarray(np.nanmean(turned, axis=0))


def mean_pose(T: FloatArray, measured: FloatArray) -> FloatArray:
    """(4, 4) the mean place on the tool, from poses (N, 4, 4) of the tool and of what is on it."""
    R, apart = T[:, :3, :3].swapaxes(-1, -2), measured[:, :3, 3] - T[:, :3, 3]
    return _pose(
        _rotation((R @ measured[:, :3, :3]).sum(0)), (R @ apart[..., None])[..., 0].mean(0)
    )


class _Fits(NamedTuple):
    """k registrations side by side: rotations (k, 3, 3), shifts, targets (k, m, 3), errors (k,)."""

    R: FloatArray
    shift: FloatArray
    points: FloatArray
    error: FloatArray


class _Alternation:
    """Targets and shift from the rotation, then the rotation from them, in turns.

    The targets x_j with R_i x_j + p_i + c = R^T y_ij have the same normal equations at each
    rotation R, with the nominal orientations R_i and origins p_i.
    """

    def __init__(self, T: FloatArray, measured: FloatArray) -> None:
        """Takes nominal poses (N, 4, 4) and positions (N, m, 3), NaN where unseen."""
        seen = np.isfinite(measured).all(-1)
        index, target = np.nonzero(seen)
        self.count = measured.shape[1]
        self.origin = T[index, :3, 3]
        self.measured = measured[seen]
        rows = np.zeros((len(index), 3, self.count + 1, 3))
        rows[np.arange(len(index)), :, target] = T[index, :3, :3]
        rows[:, :, -1] = np.eye(3)
        self.solve = np.linalg.pinv(rows.reshape(3 * len(index), -1)).T
        # A product with zeros among its factors is far faster than one of axes with each target.
        self.turned = rows[:, :, :-1].reshape(3 * len(index), -1).T

    def from_rotations(self, R: FloatArray, rounds: int) -> _Fits:
        """The registrations behind some rounds, from rotations (k, 3, 3) that stop as they settle.

        A target that was never seen is at the tool's origin.
        """
        k = len(R)
        found = _Fits(R, np.zeros((k, 3)), np.zeros((k, self.count, 3)), np.full(k, np.inf))
        moving = np.arange(k)
        for _ in range(rounds):
            after = self._round(found.R[moving])
            settled = after.error > _SETTLED * found.error[moving]
            for kept, new in zip(found, after, strict=True):
                kept[moving] = new
            moving = moving[~settled]
            if not len(moving):
                break
        return found

    def _round(self, R: FloatArray) -> _Fits:
        """One round from rotations (k, 3, 3)."""
        k = len(R)
        apart = (self.measured @ R - self.origin).reshape(k, -1)
        points = (apart @ self.solve)[:, :-3]
        placed = self.origin + (points @ self.turned).reshape(k, -1, 3)
        middle, there = placed.mean(1), self.measured.mean(0)
        products = (self.measured - there).T @ (placed - middle[:, None])
        R = _rotation(products)
        shift = there - np.einsum("kij,kj->ki", R, middle)
        left = placed @ R.swapaxes(1, 2) + shift[:, None] - self.measured
        squares = np.einsum("kni,kni->k", left, left)
        return _Fits(R, shift, points.reshape(k, -1, 3), np.sqrt(squares / left.shape[1]))


def _rotation(matrix: FloatArray) -> FloatArray:
    """(..., 3, 3) the rotations R with the largest trace(R^T matrix)."""
    u, _, vt = np.linalg.svd(matrix)
    u[..., 2] *= np.sign(np.linalg.det(u @ vt))[..., None]
    return np.asarray(u @ vt)


def _pose(R: FloatArray, p: FloatArray) -> FloatArray:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, p
    return T


def _cube_rotations() -> list[FloatArray]:
    """The 24 rotations of a cube."""
    found = []
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1.0, -1.0), repeat=3):
            matrix = np.zeros((3, 3))
            matrix[range(3), order] = signs
            if np.linalg.det(matrix) > 0:
                found.append(matrix)
    return found


_CUBE = np.array(_cube_rotations())
