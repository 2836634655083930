"""Poses as they come: the rigid pose nearest to a matrix, and why a matrix is no pose.

A pose is a matrix (4, 4) with a rotation R, a translation, and the last row 0 0 0 1. Single
precision and printed digits move R off the rotations. Its distance from them is

    |R^T R - 1| / 8^0.5,   to first order |R - U| / 2^0.5 with U the nearest rotation

in the Frobenius norm. Inverses project poses that are off by at most `NEARLY_RIGID`.

Source:
    N. J. Higham, Computing the polar decomposition - with applications, 1986.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .call._call import NEARLY_RIGID, RIGID_TO_ROUNDING
from .call.validation import real_array
from .errors import InputValueError, ShapeError
from .screws import off_rotation
from .tolerances import NO_ROTATION

FloatArray = NDArray[np.float64]

__all__ = ["NEARLY_RIGID", "deviation", "project"]

_LAST_ROW = (0.0, 0.0, 0.0, 1.0)


def project(
    T: ArrayLike,
    tolerance: float = NEARLY_RIGID,
    *,
    caller: str = "se3.project",
    name: str = "T",
) -> FloatArray:
    """The rigid poses nearest to matrices that are nearly rigid.

    R becomes the nearest rotation in the Frobenius norm, the orthogonal factor of its polar
    decomposition; the translation stays, and the last row becomes 0 0 0 1.

    Args:
        T: (..., 4, 4) matrices: arrays of any real type, or nested lists.
        tolerance: Largest `deviation` that is accepted [rad].
        caller: The function that was called, for errors.
        name: Its argument, for errors.

    Returns:
        (..., 4, 4) poses, float64: T itself where it is rigid to rounding (1e-13), NaN where a
        matrix is not finite.

    Raises:
        InputValueError: If a matrix is further off, with its index and the reason; or if the
            tolerance is not positive.
        InputTypeError: If T is not made of real numbers.
        ShapeError: If its last dimensions are not (4, 4).
    """
    if not tolerance > 0:
        raise InputValueError(f"{caller}: tolerance must be positive, got {tolerance!r}")
    matrices = _matrices(caller, T, name)
    off = _deviation(matrices)
    _refuse(caller, matrices, off, tolerance, name)
    # A copy: the caller's array stays as it is.
    poses = np.array(matrices)
    poses[np.isnan(off)] = np.nan
    rounded = off > RIGID_TO_ROUNDING
    U, _, V = np.linalg.svd(matrices[rounded][:, :3, :3])
    poses[rounded, :3, :3] = U @ V
    poses[rounded, 3] = _LAST_ROW
    return poses


def deviation(T: ArrayLike) -> FloatArray:
    """How far matrices are from rigid poses.

    Args:
        T: (..., 4, 4) matrices.

    Returns:
        (...,) the larger of |R^T R - 1| / 8^0.5 [rad] and the largest error of the last row;
        infinite where the axes are not right-handed, NaN where a matrix is not finite.

    Raises:
        InputTypeError: If T is not made of real numbers.
        ShapeError: If its last dimensions are not (4, 4).
    """
    return _deviation(_matrices("se3.deviation", T, "T"))[()]


def refuse(caller: str, T: FloatArray) -> None:
    """Raises the error for poses that are not nearly rigid; NaN passes.

    Args:
        caller: Robot and function, for the error.
        T: (..., 4, 4) matrices.

    Raises:
        InputValueError: If one is not nearly rigid, with its index and the reason.
    """
    _refuse(caller, T, _deviation(T), NEARLY_RIGID, "T")


def _matrices(caller: str, T: ArrayLike, name: str) -> FloatArray:
    matrices = real_array(caller, name, T)
    if matrices.shape[-2:] != (4, 4):
        raise ShapeError(
            f"{caller}: {name} must have shape (..., 4, 4), got shape {matrices.shape}"
        )
    return matrices


def _deviation(matrices: FloatArray) -> FloatArray:
    rows = matrices.reshape(-1, 4, 4)
    off: FloatArray = np.maximum(
        off_rotation(rows[:, :3, :3]), np.abs(rows[:, 3] - _LAST_ROW).max(-1)
    )
    with np.errstate(invalid="ignore", over="ignore"):
        left_handed = np.linalg.det(rows[:, :3, :3]) <= 0
    off[left_handed] = np.inf
    off[~np.isfinite(rows).all((-2, -1))] = np.nan
    return np.asarray(off.reshape(matrices.shape[:-2]))


def _refuse(
    caller: str, matrices: FloatArray, off: FloatArray, tolerance: float, name: str
) -> None:
    bad = np.argwhere(off > tolerance)
    if not len(bad):
        return
    first = tuple(bad[0].tolist())
    where = f"{name}[{', '.join(map(str, first))}]" if first else name
    others = f"; {len(bad) - 1} more of {off.size} are no poses either" if len(bad) > 1 else ""
    raise InputValueError(f"{caller}: {where} is {_fault(matrices[first], tolerance)}{others}")


def _fault(T: FloatArray, tolerance: float) -> str:
    """What is wrong with a finite matrix that is no pose, and what to do."""
    row, R = T[3], T[:3, :3]
    if np.abs(row - _LAST_ROW).max() > tolerance:
        if not T[:3, 3].any() and abs(row[3] - 1) <= tolerance:
            p = _numbers(row[:3])
            return f"transposed: the last row holds the translation {p}; pass T.swapaxes(-1, -2)"
        return f"no pose: its last row is {_numbers(row)}, not 0 0 0 1"
    lengths = np.linalg.norm(R, axis=0)
    shape = off_rotation((R / np.where(lengths > 0, lengths, 1.0))[None])[0]
    determinant = float(np.linalg.det(R))
    if determinant < 0 and shape <= NO_ROTATION:
        return (
            f"no rotation: determinant {determinant:.4g}, the axes are left-handed; one of them "
            "points the wrong way, or two are exchanged"
        )
    off = float(off_rotation(R[None])[0])
    if shape <= tolerance and off > NO_ROTATION:
        return f"no rotation: its axes have the lengths {_numbers(lengths)}, not 1; divide by them"
    reason = f"no rotation: off by {off:.2g} rad, and up to {tolerance:g} passes as rounding"
    if determinant <= 0 or off > NO_ROTATION:
        return f"{reason}; is it a rotation matrix, in rows and columns?"
    return f"{reason}; chasles.se3.project(T, tolerance={_above(off):g}) takes the nearest rotation"


def _numbers(values: FloatArray) -> str:
    return " ".join(f"{value:.4g}" for value in values)


def _above(value: float) -> float:
    """The next number above with one digit."""
    unit = 10.0 ** math.floor(math.log10(value))
    return float(f"{(math.floor(value / unit) + 1) * unit:.1g}")
