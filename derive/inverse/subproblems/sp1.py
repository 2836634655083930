"""Subproblem 1: the angle of a rotation about a known axis that carries a vector to another.

Statement: ``R(k, theta) p = v``.

Derivation: with ``p' = p - k (k . p)`` the rotated vector is ``k (k . p) + cos p' + sin (k x p)``;
its products with p' and with k x p, both of one length and perpendicular, are
``p' . v = |p'|^2 cos`` and ``(k x p) . v = |p'|^2 sin``. So the angle is the direction of
``(p' . v, (k x p) . v)`` for any length of v: where v differs from p in length or in the component
along k, this is the least-squares answer.

Degenerate: where p or v lies along k the angle is arbitrary and taken as 0.

Source: Paden 1986; Murray, Li and Sastry 1994, 3.3; Elias and Wen 2022, subproblem 1.
"""

from ...terms.terms import Terms
from ...terms.vectors import Vector, cross, dot
from .equations import Direction
from .found import FoundTurn
from .turns import direction, perpendicular


def sp1(terms: Terms, k: Vector, p: Vector, v: Vector, *, sure: bool = False) -> FoundTurn:
    """The turn about the unit vector k that carries p to v (of equal length and component along k).

    Args:
        terms: Names of all terms.
        k: The axis.
        p: The vector before the turn.
        v: The vector after it.
        sure: Whether neither of them ever lies along k.
    """
    across = perpendicular(terms, k, p)
    if not all(map(terms.is_constant, across)):
        # Near the axis, the rounding error of p along k would be multiplied by the long part of v.
        v = perpendicular(terms, k, v)
    x = dot(terms, across, v)
    y = dot(terms, cross(terms, k, across), v)
    return FoundTurn(direction(terms, x, y, sure=sure), Direction(x, y))
