"""Array types, named after their element types, and a check that values are real numbers."""

from __future__ import annotations

import operator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .errors import InputTypeError, InputValueError

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.intp]


def real_array(caller: str, name: str, given: Any) -> FloatArray:
    """Return an array of integers or floats as float64. Other values raise an InputTypeError."""
    if isinstance(given, np.ndarray) and given.dtype == np.float64:
        return given
    try:
        array = np.asarray(given)
    except (TypeError, ValueError) as error:
        raise InputTypeError(
            f"{caller}: {name} cannot be read as an array of numbers: {error}"
        ) from None
    if array.dtype.kind not in "iuf":
        raise InputTypeError(f"{caller}: {name} must hold real numbers, got dtype {array.dtype}")
    return array.astype(np.float64, copy=False)


def whole_number(method: str, name: str, given: object, least: int, most: int | None) -> int:
    """Return an integer argument of a method. Other values raise an InputValueError."""
    try:
        number = operator.index(given)  # type: ignore[arg-type]
    except TypeError:
        number = least - 1
    if number < least or (most is not None and number > most):
        expected = f"from {least} to {most}" if most is not None else f"of at least {least}"
        wrong = f"expected {name} to be an integer {expected}, got {given!r}"
        raise InputValueError(f"{method}: {wrong}")
    return number
