"""Validation of arguments that must be real numbers."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import FloatArray
from ..errors import InputTypeError


def real_array(caller: str, name: str, given: Any) -> FloatArray:
    """Return a float64 array of integers or floats; raise an InputTypeError for other values."""
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
