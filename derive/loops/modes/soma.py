"""Numerical model of a platform on six rods in Study (soma) coordinates.

The platform has the position p, and its rotation maps a vector b to e b / e with the quaternion e.
The quaternions e and g = p e represent the platform pose and satisfy e.g = 0. The matrices L(v) and
R(v) multiply a quaternion by a vector v from the left and from the right. The equation of a rod
with length l from the fixed point a to the platform point b has two forms:

    |g + e b - a e|^2 = l^2 e.e,   g.g + 2 g.M e + e.S e = 0.

In the second form of the rod equation, M = R(b) - L(a), S = c + 2 L(a) R(b), and c = |a|^2 + |b|^2
- l^2.

Poses and rod data may be complex, and scalar products do not conjugate their factors.

Source:
    Wampler 1996, Forward displacement analysis of general six-in-parallel SPS (Stewart) platform
    manipulators using soma coordinates.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
"""An array of complex numbers, in double precision or from mpmath."""
RODS, SOMA = 6, 8


@dataclass(frozen=True)
class SixRods:
    """Six rods from fixed points to platform points. All lengths have the same unit.

    Attributes:
        a: Array (6, 3) of the rod ends on the fixed side.
        b: Array (6, 3) of the rod ends on the platform, in platform axes.
        c: Array (6,) of |a|^2 + |b|^2 - l^2 with the rod lengths l.
    """

    a: Array
    b: Array
    c: Array


def left(v: Array) -> Array:
    """Return matrices (n, 4, 4) of the products v x of vectors v (n, 3) with quaternions x."""
    return _matrices(v, 1)


def right(v: Array) -> Array:
    """Return the matrices (n, 4, 4) that multiply a quaternion x by v from the right."""
    return _matrices(v, -1)


def _matrices(v: Array, side: int) -> Array:
    x, y, z = v[:, 0], v[:, 1], v[:, 2]
    found = np.zeros((len(v), 4, 4), v.dtype)
    found[:, 0, 1:], found[:, 1:, 0] = -v, v
    found[:, 1, 2], found[:, 1, 3], found[:, 2, 3] = -side * z, side * y, -side * x
    found[:, 2, 1], found[:, 3, 1], found[:, 3, 2] = side * z, -side * y, side * x
    return found


def quadrics(rods: SixRods) -> Array:
    """Return symmetric matrices H (7, 8, 8) of the equations x.H x = 0 with x = (e, g).

    Subtraction of the last rod equation removes the term g.g from the other five rod equations. The
    seventh equation is ``e . g = 0``.
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
    """Return |e.e| for poses (e, g) of unit norm.

    For a pose at infinity, |e.e| is 0.
    """
    return np.asarray(np.abs((x[:, :4] ** 2).sum(1)))


def residuals(rods: SixRods, x: Array) -> Array:
    """Return the residuals (n, 7) of the rod equations and of e.g = 0 at poses x (n, 8).

    The residuals have the number type of x.
    """
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
