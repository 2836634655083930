"""Subproblem 1: the rotation about an axis that moves one vector to another.

Statement: The equation ``R(k, theta) p = v`` is solved for the angle theta.

Derivation: let ``p' = p - k (k.p)`` be the component of p perpendicular to k. The rotated vector is
``k (k.p) + cos(theta) p' + sin(theta) (k x p)``. The vectors p' and k x p are perpendicular and
equally long. Therefore, ``p'.v = |p'|^2 cos(theta)`` and ``(k x p).v = |p'|^2 sin(theta)``. For any
length of v, theta is the direction angle of the planar vector ``(p'.v, (k x p).v)``. If v and p
differ in length or in the component along k, the angle is the least-squares solution.

Degenerate: if p or v is parallel to k, the angle is arbitrary and set to 0.

Source: Paden 1986; Murray, Li and Sastry 1994, 3.3, and Elias and Wen 2022, subproblem 1.
"""

from ...terms.terms import Terms
from ...terms.vectors import Vector, cross, dot
from .equations import Direction
from .found import FoundTurn
from .turns import direction, perpendicular


def sp1(terms: Terms, k: Vector, p: Vector, v: Vector, *, is_regular: bool = False) -> FoundTurn:
    """Return the rotation about the unit vector k that moves p to v.

    The vectors p and v should have equal lengths and equal components along k.

    Args:
        terms: Table of named terms.
        k: The axis.
        p: The vector before the rotation.
        v: The vector after the rotation.
        is_regular: Whether neither p nor v is parallel to k for any input.
    """
    across = perpendicular(terms, k, p)
    if not all(map(terms.is_constant, across)):
        # If p is nearly parallel to k, a component of v along k would amplify the rounding error of
        # p in x and y.
        v = perpendicular(terms, k, v)
    x = dot(terms, across, v)
    y = dot(terms, cross(terms, k, across), v)
    return FoundTurn(direction(terms, x, y, is_regular=is_regular), Direction(x, y))
