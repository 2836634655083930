"""The result of an inverse where no solution exists."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


class LeastSquares(NamedTuple):
    """The coordinates that come nearest to poses out of reach.

    Attributes:
        q: (..., n) coordinates [rad or m]; NaN where the pose has solutions.
        residual: (...,) error of the tool [m], as in Solutions; NaN where the pose has solutions.
    """

    q: FloatArray
    residual: FloatArray
