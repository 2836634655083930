"""Low-discrepancy points, which fill the unit cube evenly in any number."""

from __future__ import annotations

import numpy as np

from .arrays import FloatArray


def low_discrepancy(begin: int, end: int, n: int, first: FloatArray | float = 0.5) -> FloatArray:
    """Points x_k of a sequence that leaves no large gap, whatever its length.

    `x_k = first + k (1/g, 1/g^2, ..., 1/g^n) modulo 1`, with `g^(n+1) = g + 1`, which for n = 1 is
    the golden ratio.

    Args:
        begin: The first k.
        end: The k after the last.
        n: The dimension of the cube.
        first: () or (n,) the point x_0.

    Returns:
        (end - begin, n) points in [0, 1).

    Source:
        Roberts, The unreasonable effectiveness of quasirandom sequences, 2018.
    """
    g = 2.0
    for _ in range(64):  # a fixed point, at least three times nearer each time
        g = (1 + g) ** (1 / (n + 1))
    steps = g ** -np.arange(1.0, n + 1)
    return np.asarray((first + np.arange(begin, end)[:, None] * steps) % 1)
