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

_ROUNDS = 30
"""Alternations from each of 24 rotations; the best of them is refined by the identification."""


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
    candidates = (_alternated(T, measured, R) for R in _cube_rotations())
    return min(candidates, key=lambda found: found.error)


def register_poses(T: FloatArray, measured: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The frames T_W_base and T_tool_probe that fit measured poses best.

    Args:
        T: (N, 4, 4) nominal poses of the tool in the base frame.
        measured: (N, 4, 4) poses of the probe in the device's frame.
    """
    R, Y = T[:, :3, :3], measured[:, :3, :3]
    # R_base_W = R_i R_tool_probe Y_i^T for all i: the largest singular value's pair of vectors.
    products = np.einsum("nij,nkl->ikjl", R, Y).reshape(9, 9)
    X = np.linalg.svd(products)[2][0].reshape(3, 3)
    R_tool_probe = _rotation(X * np.sign(np.linalg.det(X)))
    R_base_W = _rotation(np.einsum("nij,jk,nlk->il", R, R_tool_probe, Y))
    # R_base_W y_i - p_i = R_i t_tool_probe - t_base_W
    rows = np.concatenate([R, np.broadcast_to(-np.eye(3), R.shape)], -1).reshape(-1, 6)
    right = measured[:, :3, 3] @ R_base_W.T - T[:, :3, 3]
    found = np.linalg.lstsq(rows, right.ravel())[0]
    T_W_base = np.linalg.inv(_pose(R_base_W, found[3:]))
    return T_W_base, _pose(R_tool_probe, found[:3])


def _alternated(T: FloatArray, measured: FloatArray, R: FloatArray) -> Registration:
    """Targets and shift from the rotation, then the rotation from them, in turns."""
    N, m, _ = measured.shape
    seen = np.isfinite(measured).all(-1)
    design = np.zeros((N, m, 3, 3 * m + 3))
    design[..., -3:] = np.eye(3)
    points, shift = np.zeros((m, 3)), np.zeros(3)
    for _ in range(_ROUNDS):
        for j in range(m):
            design[:, j, :, 3 * j : 3 * j + 3] = R @ T[:, :3, :3]
        right = measured - (T[:, :3, 3] @ R.T)[:, None]
        found = np.linalg.lstsq(design[seen].reshape(-1, 3 * m + 3), right[seen].ravel())[0]
        points, shift = found[:-3].reshape(m, 3), found[-3:]
        placed = T[:, None, :3, 3] + np.einsum("nij,mj->nmi", T[:, :3, :3], points)
        R = _rotation(np.einsum("ni,nj->ij", *(_centred(v[seen]) for v in (measured, placed))))
    shift = (measured - placed @ R.T)[seen].mean(0)
    apart = (placed @ R.T + shift - measured)[seen]
    return Registration(_pose(R, shift), points, float(np.sqrt((apart**2).sum(-1).mean())))


def _centred(points: FloatArray) -> FloatArray:
    return np.asarray(points - points.mean(0))


def _rotation(matrix: FloatArray) -> FloatArray:
    """The rotation R with the largest trace(R^T matrix)."""
    u, _, vt = np.linalg.svd(matrix)
    mirror = np.diag([1, 1, np.sign(np.linalg.det(u @ vt))])
    return np.asarray(u @ mirror @ vt)


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
