"""Rotations of SO(3) on NumPy arrays: exponential and logarithm.

Angles are in radians. Leading dimensions broadcast, and NaN propagates. The functions do not check
that a matrix is a rotation.

Source:
    R. M. Murray, Z. Li, S. S. Sastry, A Mathematical Introduction to Robotic Manipulation, 1994,
    chapter 2.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .arrays import FloatArray, real_array
from .errors import ShapeError
from .tolerances import SERIES

__all__ = ["exp", "log"]


def exp(omega: ArrayLike) -> FloatArray:
    """Return the rotation matrices (..., 3, 3) of rotation vectors (..., 3) [rad], of any angle.

    A rotation vector is the unit axis times the angle. Another shape raises `ShapeError`.

    Source: Murray, Li and Sastry, chapter 2, section 2, Rodrigues' formula.
    """
    w = ending(omega, (3,), "so3.exp", "omega")
    x, y, z = np.moveaxis(w, -1, 0)
    o = np.zeros_like(x)
    hat = np.stack([o, -z, y, z, o, -x, -y, x, o], -1).reshape(*w.shape, 3)
    angle = np.sqrt(np.sum(w * w, -1))[..., None, None]
    sine, versine, _ = exponential(angle)
    return np.asarray(np.eye(3) + sine * hat + versine * (hat @ hat))


def log(R: ArrayLike) -> FloatArray:
    """Return the rotation vectors (..., 3) [rad] of rotation matrices (..., 3, 3).

    A rotation vector is the unit axis times the angle in [0, pi]. For the angle pi, two vectors
    with opposite axes are possible, and always the same one is returned. Another shape raises
    `ShapeError`.
    """
    rotations = ending(R, (3, 3), "so3.log", "R")
    # The antisymmetric part is the axis times the sine; the trace yields the cosine. The sine
    # vanishes at pi. For angles above pi / 2, the axis a is therefore computed from the symmetric
    # part (1 - cos) a a^T + cos 1.
    w = (rotations - np.swapaxes(rotations, -1, -2))[..., [2, 0, 1], [1, 2, 0]] / 2
    sine = np.sqrt(np.sum(w * w, -1))[..., None]
    cosine = (np.trace(rotations, axis1=-2, axis2=-1)[..., None] - 1) / 2
    angle = np.arctan2(sine, cosine)
    near = w * np.divide(angle, sine, out=np.ones_like(angle), where=sine != 0)
    return np.asarray(np.where(cosine < 0, angle * _axis(rotations, w, cosine), near))


def off_rotation(R: FloatArray) -> FloatArray:
    """Return |R^T R - 1|_F / 8^0.5, the first-order distance of R (N, 3, 3) from orthogonality."""
    with np.errstate(invalid="ignore", over="ignore"):
        x, y, z = R.transpose(2, 1, 0)
        lengths = sum(((a * a).sum(0) - 1) ** 2 for a in (x, y, z))
        angles = sum((a * b).sum(0) ** 2 for a, b in ((x, y), (y, z), (z, x)))
        return np.asarray(np.sqrt(lengths / 8 + angles / 4))


def ending(values: ArrayLike, shape: tuple[int, ...], name: str, argument: str) -> FloatArray:
    """Check the last dimensions of an array, and return the array as float64."""
    array = real_array(name, argument, values)
    if array.shape[-len(shape) :] != shape:
        wanted = ", ".join(["...", *map(str, shape)])
        raise ShapeError(f"{name}: expected {argument} of shape ({wanted}), got {array.shape}")
    return array


def _axis(R: FloatArray, w: FloatArray, cosine: FloatArray) -> FloatArray:
    """Return the axis of a rotation by more than pi / 2, with a nonnegative dot product with w."""
    symmetric = (R + np.swapaxes(R, -1, -2)) / 2 - cosine[..., None] * np.eye(3)
    largest = np.argmax(np.diagonal(symmetric, axis1=-2, axis2=-1), -1)
    column = np.take_along_axis(symmetric, largest[..., None, None], -1)[..., 0]
    length = np.sqrt(np.sum(column * column, -1))[..., None]
    side = np.where(np.sum(column * w, -1) < 0, -1.0, 1.0)[..., None]
    # All columns of `symmetric` are 0 only for small angles, for which the axis is not used.
    return np.asarray(side * np.divide(column, length, out=np.zeros_like(column), where=length > 0))


def exponential(x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the quotients sin x / x, (1 - cos x) / x^2 and (x - sin x) / x^3."""
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


def inverse_cubic(x: FloatArray) -> FloatArray:
    """Return (1 - x / 2 cot(x / 2)) / x^2, for x in [0, pi]."""
    small = x < SERIES
    x2 = np.where(small, x * x, 0.0)
    safe = np.where(small, 1.0, x)
    closed = (1 - safe / 2 / np.tan(safe / 2)) / (safe * safe)
    series = _horner(x2, (12, 720, 30240, 1209600, 47900160, 1307674368000 / 691))
    return np.where(small, series, closed)


def _horner(x: FloatArray, divisors: tuple[float, ...]) -> FloatArray:
    total = np.zeros_like(x)
    for divisor in reversed(divisors):
        total = total * x + 1 / divisor
    return total
