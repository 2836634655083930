"""Fourteen quantities of a line, which a rigid motion transforms linearly.

Let p be a point on a line with unit direction l. The equations of Raghavan and Roth use the
fourteen quantities ``x = (p, l, p.p, p.l, p x l, (p.p) l - 2 (p.l) p)``. A rigid motion with
rotation R and translation d maps p to R p + d and l to R l. Therefore, a rigid motion multiplies
the vector (x, 1) by a matrix that depends only on the rotation R and the translation d. If a
revolute joint moves the line, each of the fourteen quantities is linear in the cosine and sine of
the joint angle. If a prismatic joint moves the line, each quantity is quadratic in the
displacement. Let h = R^T d and w = (p.p) l - 2 (p.l) p. The following formulas give the quantities
of a line after a rigid motion.

    A point moves by ``p' = R p + d``, and a direction by ``l' = R l``.

    The scalar products become ``p'.p' = p.p + 2 h.p + d.d`` and ``p'.l' = p.l + h.l``.

    The cross product becomes ``p' x l' = R (p x l) + d x R l``.

    The vector w becomes ``w' = R w - 2 d x R (p x l) + (d.d) R l - 2 (h.l) d - 2 (p.l) d``.

The formula for w' follows from the identity d x (b x c) = b (d.c) - c (d.b).

Source:
    Raghavan and Roth, Inverse kinematics of the general 6R manipulator and related
    linkages, Journal of Mechanical Design 115 (1993), section 3.
"""

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
"""Array of floats or of symbolic expressions (object dtype)."""
P, L, PP, PL, M, W, ONE = slice(0, 3), slice(3, 6), 6, 7, slice(8, 11), slice(11, 14), 14
COUNT = 14
"""Number of quantities that describe a line, without the constant 1."""
SIZE = COUNT + 1


def quantities(p: Array, direction: Array) -> Array:
    """Return the fourteen quantities of a line, followed by 1, as a vector (15,)."""
    pp, pl = p @ p, p @ direction
    moment = hat(p) @ direction
    return np.array([*p, *direction, pp, pl, *moment, *(pp * direction - 2 * pl * p), 1], p.dtype)


def motion(T: Array) -> Array:
    """Return the matrix (15, 15) by which a rigid motion T (4, 4) transforms ``quantities``."""
    R, d = T[:3, :3], T[:3, 3]
    A = np.zeros((SIZE, SIZE), T.dtype)
    h, dd, cross = R.T @ d, d @ d, hat(d) @ R
    for block in (P, L, M, W):
        A[block, block] = R
    A[PP, PP] = A[PL, PL] = A[ONE, ONE] = 1
    A[P, ONE] = d
    A[PP, P], A[PP, ONE] = 2 * h, dd
    A[PL, L] = h
    A[M, L] = cross
    A[W, M], A[W, L], A[W, PL] = -2 * cross, dd * R - 2 * np.outer(d, h), -2 * d
    return A


@cache
def turn(sign: int) -> tuple[Array, Array, Array]:
    """Return (M0, M1, M2) of M0 + M1 cos a + M2 sin a for a rotation by sign * a about z.

    Each of the three matrices has the shape (15, 15).
    """
    fixed, c, s = (np.zeros((SIZE, SIZE), int) for _ in range(3))
    for block in (P, L, M, W):
        x, y, z = range(SIZE)[block]
        fixed[z, z] = c[x, x] = c[y, y] = 1
        s[y, x], s[x, y] = sign, -sign
    for k in (PP, PL, ONE):
        fixed[k, k] = 1
    for matrix in (fixed, c, s):
        matrix.flags.writeable = False
    return fixed, c, s


@cache
def slide(sign: int) -> tuple[Array, Array, Array]:
    """Return (M0, M1, M2) of M0 + M1 d + M2 d^2 for a translation by sign * d along z.

    Each of the three matrices has the shape (15, 15).
    """
    forth, here, back = (np.eye(4, dtype=int) for _ in range(3))
    forth[2, 3], back[2, 3] = sign, -sign
    fixed, ahead, behind = motion(here), motion(forth), motion(back)
    parts = fixed, (ahead - behind) // 2, (ahead + behind) // 2 - fixed
    for matrix in parts:
        matrix.flags.writeable = False
    return parts


def hat(v: Array) -> Array:
    """Return the matrix (3, 3) that maps a vector u to v x u."""
    x, y, z = v
    return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]], v.dtype)
