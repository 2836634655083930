"""Low-discrepancy sequences, which fill the unit cube evenly."""

from __future__ import annotations

import numpy as np

from .arrays import FloatArray


def low_discrepancy(begin: int, end: int, n: int, first: FloatArray | float = 0.5) -> FloatArray:
    """Return points of a low-discrepancy sequence in [0, 1) as an array (end - begin, n).

    The rows are `x_k = first + k (1/g, 1/g^2, ..., 1/g^n) modulo 1` for begin <= k < end, with
    `g^(n+1) = g + 1`. The first point x_0 is a number () or a vector (n,).

    Source:
        Roberts, The unreasonable effectiveness of quasirandom sequences, 2018.
    """
    g = 2.0
    for _ in range(64):  # fixed-point iteration; the error falls by a factor of 3 or more
        g = (1 + g) ** (1 / (n + 1))
    steps = g ** -np.arange(1.0, n + 1)
    return np.asarray((first + np.arange(begin, end)[:, None] * steps) % 1)
