"""A platform on six rods in Study's coordinates, in numbers.

Quaternions e and g = p e, with e.g = 0, hold the rotation b -> e b / e of the platform and its
position p. A rod of length l from a to b holds, with the matrices L and R of products from the left
and from the right,

    |g + e b - a e|^2 = l^2 e.e     or     g.g + 2 g.M e + e.S e = 0
    M = R(b) - L(a),   S = c + 2 L(a) R(b),   c = |a|^2 + |b|^2 - l^2

All of it may be complex. Scalar products are bilinear.

Source:
    Wampler 1996, Forward displacement analysis of general six-in-parallel SPS (Stewart) platform
    manipulators using soma coordinates.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
"""Complex numbers, or objects of mpmath."""
RODS, SOMA = 6, 8


@dataclass(frozen=True)
class SixRods:
    """Six rods, each between a point and a point on the platform; lengths in one unit.

    Attributes:
        a: (6, 3) ends apart from the platform.
        b: (6, 3) ends on the platform, in its axes.
        c: (6,) |a|^2 + |b|^2 - l^2, l the lengths.
    """

    a: Array
    b: Array
    c: Array


def left(v: Array) -> Array:
    """(n, 4, 4) matrices of the products v x of vectors v (n, 3) with quaternions x."""
    return _matrices(v, 1)


def right(v: Array) -> Array:
    """(n, 4, 4) matrices of the products x v."""
    return _matrices(v, -1)


def _matrices(v: Array, side: int) -> Array:
    x, y, z = v[:, 0], v[:, 1], v[:, 2]
    found = np.zeros((len(v), 4, 4), v.dtype)
    found[:, 0, 1:], found[:, 1:, 0] = -v, v
    found[:, 1, 2], found[:, 1, 3], found[:, 2, 3] = -side * z, side * y, -side * x
    found[:, 2, 1], found[:, 3, 1], found[:, 3, 2] = side * z, -side * y, side * x
    return found


def quadrics(rods: SixRods) -> Array:
    """(7, 8, 8) symmetric matrices H of the equations x.H x = 0, x = (e, g).

    The last rod's equation is subtracted from those of the others, which leaves no g.g in them. The
    seventh equation is e.g = 0.
    """
    L, R = left(rods.a), right(rods.b)
    H = np.zeros((7, SOMA, SOMA), np.complex128)
    H[:RODS, :4, :4] = rods.c[:, None, None] * np.eye(4) + 2 * L @ R
    H[:RODS, 4:, :4] = R - L
    H[:RODS, :4, 4:] = np.swapaxes(R - L, 1, 2)
    H[:RODS, 4:, 4:] = np.eye(4)
    H[: RODS - 1] -= H[RODS - 1]
    H[RODS, :4, 4:] = H[RODS, 4:, :4] = np.eye(4) / 2
    return H


def finite(x: Array) -> Array:
    """|e.e| of poses of length 1: 0 at infinity."""
    return np.asarray(np.abs((x[:, :4] ** 2).sum(1)))


def residuals(rods: SixRods, x: Array) -> Array:
    """(n, 7) values of the equations at poses x (n, 8), in the arithmetic of the arguments."""
    e, g = x[:, :4], x[:, 4:]
    L, R = left(rods.a), right(rods.b)
    values = []
    for i in range(RODS):
        turned, moved = e @ R[i].T, e @ L[i].T
        d = g + turned - moved
        squares = (rods.a[i] ** 2).sum() + (rods.b[i] ** 2).sum() - rods.c[i]
        values.append((d * d).sum(1) - squares * (e * e).sum(1))
    last = values[-1]
    return np.stack([*(value - last for value in values[:-1]), last, (e * g).sum(1)], 1)
