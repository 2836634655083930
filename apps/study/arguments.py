"""Checks that arguments of studies are finite numbers, rigid poses or integer counts."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chasles import InputTypeError, InputValueError, ShapeError
from chasles.arrays import real_array
from chasles.se3 import project

FloatArray = NDArray[np.float64]
Rng = int | np.random.Generator | None

_SEEDS = 2**63
"""Exclusive upper bound of the seeds that are drawn from a random generator."""


def real(name: str, values: Any) -> FloatArray:
    """Return a float64 array of real numbers.

    Args:
        name: Names of the function and the argument, for error messages.
        values: The numbers.

    Raises:
        InputTypeError: `values` contains complex numbers or values that are not numbers.
    """
    caller, _, argument = name.partition(": ")
    return real_array(caller, argument or "the values", values)


def finite(name: str, values: ArrayLike, shape: tuple[int, ...] | None = None) -> FloatArray:
    """Return an array of finite numbers.

    Args:
        name: Names of the function and the argument, for error messages.
        values: The numbers.
        shape: The expected shape, or None to accept every shape.

    Raises:
        InputTypeError: `values` contains complex numbers or values that are not numbers.
        ShapeError: The array does not have the expected shape.
        InputValueError: A number is NaN or infinite.
    """
    array = real(name, values)
    if shape is not None and array.shape != shape:
        raise ShapeError(f"{name}: expected shape {shape}, got {array.shape}")
    if not np.isfinite(array).all():
        raise InputValueError(f"{name}: expected finite numbers, got {_worst(array)}")
    return array


def above_0(name: str, value: float) -> float:
    """Return a number after checking that it is finite and above 0.

    Raises:
        InputTypeError: The value is not a real number.
        InputValueError: The number is not finite or not positive.
    """
    found = number(name, value)
    if not 0 < found < math.inf:
        raise InputValueError(f"{name}: expected a finite value above 0, got {found:g}")
    return found


def number(name: str, value: Any) -> float:
    """Return a scalar argument as a float, which may be infinite.

    Raises:
        InputTypeError: The value is not a real number.
        ShapeError: The value is an array with one or more dimensions.
    """
    array = real(name, value)
    if array.ndim:
        raise ShapeError(f"{name}: expected a number, got shape {array.shape}")
    return float(array)


def poses(name: str, T: ArrayLike) -> FloatArray:
    """Return rigid poses (..., 4, 4). Nearly rigid poses are projected to the nearest rigid poses.

    Raises:
        ShapeError: The last two dimensions of `T` are not (4, 4).
        InputValueError: `T` contains a number that is not finite, or a pose that is not rigid.
    """
    array = real(name, T)
    if array.shape[-2:] != (4, 4):
        raise ShapeError(f"{name}: expected poses (..., 4, 4), got shape {array.shape}")
    caller, _, argument = name.partition(": ")
    return project(finite(name, array), caller=caller, name=argument or "T")


def pose(name: str, T: ArrayLike) -> FloatArray:
    """Return a rigid pose (4, 4). A nearly rigid pose is projected to the nearest rigid pose.

    Raises:
        ShapeError: `T` is not (4, 4).
        InputValueError: `T` contains a number that is not finite, or is not rigid.
    """
    return poses(name, finite(name, T, (4, 4)))


def integer_at_least(name: str, value: Any, least: int) -> int:
    """Return an integer argument, which may be passed as an int or as a float such as 1e9.

    Raises:
        InputTypeError: The value is not a real number.
        InputValueError: The number has a fractional part or is less than `least`.
    """
    found = number(name, value)
    if not found.is_integer() or found < least:
        raise InputValueError(f"{name} = {value}: expected an integer of at least {least}")
    return int(value)


def key_of(name: str, rng: Rng) -> int:
    """Return the int that seeds the random number generator.

    Args:
        name: Name of the calling function, for error messages.
        rng: Seed of the random numbers, a generator that supplies the seed, or None for an
            unpredictable seed.

    Raises:
        InputTypeError: `rng` is not an int, a `Generator` or None.
        InputValueError: The seed is negative.
    """
    if rng is None:
        rng = np.random.default_rng()
    if isinstance(rng, np.random.Generator):
        return int(rng.integers(_SEEDS))
    if isinstance(rng, bool) or not isinstance(rng, int | np.integer):
        raise InputTypeError(f"{name}: rng: expected an int, a Generator or None, got {rng!r}")
    if rng < 0:
        raise InputValueError(f"{name}: rng: expected an int of at least 0, got {rng}")
    return int(rng)


def _worst(array: FloatArray) -> str:
    at = np.argwhere(~np.isfinite(array))[0]
    place = f" at {tuple(int(k) for k in at)}" if len(at) else ""
    return f"{array[tuple(at)]}{place}"
