"""Poses and twists of SE(3) on NumPy arrays: exponential, logarithm, and interpolation of poses.

Twists are (v, omega), linear part first. `exp` of a twist is the pose of a body that has moved with
it for one unit of time, pose and twist expressed in the frame of the start. Lengths are in metres,
angles in radians. Leading dimensions broadcast. NaN propagates; the functions do not check that a
matrix is a rigid pose.

Sources:
    R. M. Murray, Z. Li, S. S. Sastry, A Mathematical Introduction to Robotic Manipulation, 1994,
    chapter 2.
    K. M. Lynch, F. C. Park, Modern Robotics, 2017, section 9.2.1, for the interpolation.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import ShapeError
from .tolerances import SERIES

FloatArray = NDArray[np.float64]

__all__ = ["exp", "exp_rotation", "interpolate", "inverse", "log", "log_rotation", "straight"]


def exp(twist: ArrayLike) -> FloatArray:
    """The pose that a twist leads to.

    Args:
        twist: (..., 6) (v, omega), of any angle.

    Returns:
        (..., 4, 4) pose; `exp(log(T)) = T`.

    Raises:
        ShapeError: If the last dimension is not 6.

    Source: Murray, Li and Sastry, chapter 2, section 3.
    """
    x = _ending(twist, (6,), "exp", "twist")
    v, omega = x[..., :3], x[..., 3:]
    angle = np.sqrt(np.sum(omega * omega, -1))[..., None]
    _, versine, cubic = _exponential(angle)
    once = np.cross(omega, v)
    return _pose(exp_rotation(omega), v + versine * once + cubic * np.cross(omega, once))


def log(T: ArrayLike) -> FloatArray:
    """The twist that leads to a pose, along the shorter way round.

    At a half turn two twists with opposite axes lead there. The result is one of them, always the
    same for the same pose, but near a half turn a small change of the pose may exchange them.

    Args:
        T: (..., 4, 4) poses.

    Returns:
        (..., 6) twist (v, omega) with |omega| in [0, pi]; `exp(log(T)) = T`.

    Raises:
        ShapeError: If the last dimensions are not (4, 4).

    Source: Murray, Li and Sastry, chapter 2, section 3.
    """
    poses = _ending(T, (4, 4), "log", "T")
    omega, p = log_rotation(poses[..., :3, :3]), poses[..., :3, 3]
    angle = np.sqrt(np.sum(omega * omega, -1))[..., None]
    once = np.cross(omega, p)
    v = p - once / 2 + _inverse_cubic(angle) * np.cross(omega, once)
    return np.concatenate([v, omega], -1)


def exp_rotation(omega: ArrayLike) -> FloatArray:
    """The rotation by a rotation vector.

    Args:
        omega: (..., 3) axis times angle, of any angle.

    Returns:
        (..., 3, 3) rotation.

    Raises:
        ShapeError: If the last dimension is not 3.

    Source: Murray, Li and Sastry, chapter 2, section 2, Rodrigues' formula.
    """
    w = _ending(omega, (3,), "exp_rotation", "omega")
    x, y, z = np.moveaxis(w, -1, 0)
    o = np.zeros_like(x)
    hat = np.stack([o, -z, y, z, o, -x, -y, x, o], -1).reshape(*w.shape, 3)
    angle = np.sqrt(np.sum(w * w, -1))[..., None, None]
    sine, versine, _ = _exponential(angle)
    return np.asarray(np.eye(3) + sine * hat + versine * (hat @ hat))


def log_rotation(R: ArrayLike) -> FloatArray:
    """The rotation vector of a rotation, along the shorter way round; see `log`.

    Args:
        R: (..., 3, 3) rotations.

    Returns:
        (..., 3) axis times angle, the angle in [0, pi].

    Raises:
        ShapeError: If the last dimensions are not (3, 3).
    """
    rotations = _ending(R, (3, 3), "log_rotation", "R")
    # The antisymmetric part is the axis times the sine, the trace gives the cosine. Beyond a
    # quarter turn the axis comes from the symmetric part, (1 - cos) a a^T + cos: at a half turn the
    # sine is lost.
    w = (rotations - np.swapaxes(rotations, -1, -2))[..., [2, 0, 1], [1, 2, 0]] / 2
    sine = np.sqrt(np.sum(w * w, -1))[..., None]
    cosine = (np.trace(rotations, axis1=-2, axis2=-1)[..., None] - 1) / 2
    angle = np.arctan2(sine, cosine)
    near = w * np.divide(angle, sine, out=np.ones_like(angle), where=sine != 0)
    return np.asarray(np.where(cosine < 0, angle * _axis(rotations, w, cosine), near))


def inverse(T: ArrayLike) -> FloatArray:
    """The inverse of a pose: `inverse(T_a_b) = T_b_a`.

    Args:
        T: (..., 4, 4) poses.

    Returns:
        (..., 4, 4) poses.

    Raises:
        ShapeError: If the last dimensions are not (4, 4).
    """
    poses = _ending(T, (4, 4), "inverse", "T")
    R = np.swapaxes(poses[..., :3, :3], -1, -2)
    return _pose(R, -(R @ poses[..., :3, 3:])[..., 0])


def interpolate(T_a: ArrayLike, T_b: ArrayLike, s: ArrayLike) -> FloatArray:
    """The screw motion from one pose to another, `T_a exp(s log(T_a^-1 T_b))`.

    Its twist is constant, in the base frame and in the body's frame; the origin moves on a helix.
    The motion does not depend on the position of the frame on the body. For a half turn it is one
    of two motions.

    Args:
        T_a: (..., 4, 4) where s = 0.
        T_b: (..., 4, 4) where s = 1.
        s: (...,) parameter of the motion; below 0 and above 1 the motion continues.

    Returns:
        (..., 4, 4) poses, of the broadcast dimensions: many s between two poses give a path.

    Raises:
        ShapeError: If the last dimensions of a pose are not (4, 4).

    Source: Lynch and Park, section 9.2.1.
    """
    start, end, part = _way(T_a, T_b, s, "interpolate")
    return np.asarray(start @ exp(part[..., None] * log(inverse(start) @ end)))


def straight(T_a: ArrayLike, T_b: ArrayLike, s: ArrayLike) -> FloatArray:
    """The motion from one pose to another with the origin on a straight line.

    `p = (1 - s) p_a + s p_b` and `R = R_a exp(s log(R_a^T R_b))`: the origin moves at a constant
    velocity, the body turns about one axis, of constant direction, at a constant rate. For a half
    turn it is one of two motions.

    Args:
        T_a: (..., 4, 4) where s = 0.
        T_b: (..., 4, 4) where s = 1.
        s: (...,) parameter of the motion; below 0 and above 1 the motion continues.

    Returns:
        (..., 4, 4) poses, of the broadcast dimensions: many s between two poses give a path.

    Raises:
        ShapeError: If the last dimensions of a pose are not (4, 4).

    Source: Lynch and Park, section 9.2.1.
    """
    start, end, part = _way(T_a, T_b, s, "straight")
    R_a, R_b = start[..., :3, :3], end[..., :3, :3]
    turn = log_rotation(np.swapaxes(R_a, -1, -2) @ R_b)
    ahead = part[..., None] * (end[..., :3, 3] - start[..., :3, 3])
    return _pose(R_a @ exp_rotation(part[..., None] * turn), start[..., :3, 3] + ahead)


def off_rotation(R: FloatArray) -> FloatArray:
    """Distance of matrices (N, 3, 3) from orthogonal ones, in the norm |R_1 - R_2| / 2^0.5.

    Residuals use the same norm; to first order the distance is |R^T R - 1| / 8^0.5.
    """
    with np.errstate(invalid="ignore", over="ignore"):
        x, y, z = R.transpose(2, 1, 0)
        lengths = sum(((a * a).sum(0) - 1) ** 2 for a in (x, y, z))
        angles = sum((a * b).sum(0) ** 2 for a, b in ((x, y), (y, z), (z, x)))
        return np.asarray(np.sqrt(lengths / 8 + angles / 4))


def _way(
    T_a: ArrayLike, T_b: ArrayLike, s: ArrayLike, name: str
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Both ends and the parameter, as arrays."""
    return (
        _ending(T_a, (4, 4), name, "T_a"),
        _ending(T_b, (4, 4), name, "T_b"),
        np.asarray(s, np.float64),
    )


def _ending(values: ArrayLike, shape: tuple[int, ...], name: str, argument: str) -> FloatArray:
    """An array, checked for its last dimensions."""
    array = np.asarray(values, np.float64)
    if array.shape[-len(shape) :] != shape:
        wanted = ", ".join(["...", *map(str, shape)])
        raise ShapeError(
            f"screws.{name}: expected {argument} of shape ({wanted}), got {array.shape}"
        )
    return array


def _pose(R: FloatArray, p: FloatArray) -> FloatArray:
    shape = np.broadcast_shapes(R.shape[:-2], p.shape[:-1])
    T = np.zeros((*shape, 4, 4))
    T[..., :3, :3], T[..., :3, 3], T[..., 3, 3] = R, p, 1.0
    return T


def _axis(R: FloatArray, w: FloatArray, cosine: FloatArray) -> FloatArray:
    """The axis of a rotation by more than a quarter turn, on the side of w; any at a half turn."""
    symmetric = (R + np.swapaxes(R, -1, -2)) / 2 - cosine[..., None] * np.eye(3)
    largest = np.argmax(np.diagonal(symmetric, axis1=-2, axis2=-1), -1)
    column = np.take_along_axis(symmetric, largest[..., None, None], -1)[..., 0]
    length = np.sqrt(np.sum(column * column, -1))[..., None]
    side = np.where(np.sum(column * w, -1) < 0, -1.0, 1.0)[..., None]
    # Only for short turns, which take their axis from elsewhere, all columns vanish.
    return np.asarray(side * np.divide(column, length, out=np.zeros_like(column), where=length > 0))


def _exponential(x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The quotients sin x / x, (1 - cos x) / x^2 and (x - sin x) / x^3."""
    small = np.abs(x) < SERIES
    x2 = np.where(small, x * x, 0.0)
    safe = np.where(small, 1.0, x)
    half = np.sin(safe / 2) / safe
    sine, versine = np.sin(safe) / safe, 2 * half * half
    cubic = (1 - sine) / (safe * safe)
    return (
        np.where(small, _horner(x2, (1, -6, 120, -5040, 362880, -39916800)), sine),
        np.where(small, _horner(x2, (2, -24, 720, -40320, 3628800, -479001600)), versine),
        np.where(small, _horner(x2, (6, -120, 5040, -362880, 39916800, -6227020800)), cubic),
    )


def _inverse_cubic(x: FloatArray) -> FloatArray:
    """(1 - x / 2 cot(x / 2)) / x^2, for x in [0, pi]."""
    small = x < SERIES
    x2 = np.where(small, x * x, 0.0)
    safe = np.where(small, 1.0, x)
    closed = (1 - safe / 2 / np.tan(safe / 2)) / (safe * safe)
    series = _horner(x2, (12, 720, 30240, 1209600, 47900160, 1307674368000 / 691))
    return np.where(small, series, closed)


def _horner(x: FloatArray, divisors: tuple[float, ...]) -> FloatArray:
    """The sum of x^i / divisors[i]."""
    total = np.zeros_like(x)
    for divisor in reversed(divisors):
        total = total * x + 1 / divisor
    return total
