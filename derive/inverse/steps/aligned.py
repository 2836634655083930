"""Angle of the first revolute joint if the first and the last revolute axis are parallel.

If the first and the last of three revolute axes are parallel, the orientation determines only the
sum or difference of their angles. The position then determines the first angle. Let R_1 be the
rotation of the first joint. Relative to the first axis, let ``w`` be a point on the last axis
before the rotation R_1, and ``v`` the target of this point. Let u be the direction of a prismatic
joint with displacement d. If the prismatic joint is between the first and the last axis, then ``R_1
(w + d u) = v``. If the prismatic joint is before the first or after the last axis, then ``R_1 w = v
- d u``.

If three prismatic joints have linearly independent directions, the first angle is arbitrary. If the
prismatic directions lie in a plane with normal n, the first angle solves ``n.(R_1 w) = n.v`` or
``n.(R_1^T v) = n.w``.

Both sides of ``R_1 (w + d u) = v`` or ``R_1 w = v - d u`` have equal lengths, which gives a
quadratic equation for d. With the solution for d, subproblem 1 gives the first angle.
"""

from collections.abc import Sequence

import sympy as sp

from ...terms.terms import Terms
from ...terms.vectors import Vector, added, combination, dot, subtracted
from ..structure.lines import Axis
from ..subproblems.slides import slide_to_sphere
from ..subproblems.sp1 import sp1
from ..subproblems.sp4 import sp4
from ..subproblems.turns import CosSin, rotated
from .dependent_slides import plane_normal
from .target import Target


def first_angle(
    terms: Terms, axes: Sequence[Axis], target: Target, middle: CosSin, sign: sp.Expr
) -> CosSin:
    """Return the first revolute joint's rotation for parallel first and last revolute axes.

    Args:
        terms: Table of named terms.
        axes: The joint axes of a chain with three revolute joints and at most one prismatic joint.
        target: The pose that the chain must reach.
        middle: Rotation of the second revolute joint.
        sign: 1 or -1. Selects one of two solutions.
    """
    i, j, k = (index for index, axis in enumerate(axes) if axis.turns)
    first, second = axes[i], axes[j]
    w, v = _ends(terms, axes, target, middle)
    for index, axis in enumerate(axes):
        if axis.turns:
            continue
        if index < i:
            v = _equal(terms, v, axis.h, w, sign)
        elif index < j:
            w = _equal(terms, w, axis.h, v, sign)
        elif index < k:
            w = _equal(terms, w, rotated(terms, second.h, middle, axis.h), v, sign)
        else:
            v = _equal(terms, v, target.turned(terms, axis.h), w, sign)
    return sp1(terms, first.h, w, v).turn


def first_angle_to_plane(
    terms: Terms, axes: Sequence[Axis], target: Target, middle: CosSin, sign: sp.Expr
) -> CosSin:
    """Return the first revolute angle of a chain with three revolute and three prismatic joints.

    At the returned angle, the prismatic joints can reach the target position.

    Args:
        terms: Table of named terms.
        axes: The joint axes of a chain with three revolute joints and three consecutive prismatic
            joints.
        target: The pose that the chain must reach.
        middle: Rotation of the second revolute joint.
        sign: 1 or -1. Selects one of two solutions.
    """
    i, j, k = (index for index, axis in enumerate(axes) if axis.turns)
    place = next(index for index, axis in enumerate(axes) if not axis.turns)
    w, v = _ends(terms, axes, target, middle)
    normal = plane_normal(terms, [axis.h for axis in axes if not axis.turns])
    if i < place < k:
        n = normal if place < j else rotated(terms, axes[j].h, middle, normal)
        back = axes[i].reversed()
        return sp4(terms, n, back.h, v, dot(terms, n, w), sign).turn
    n = normal if place < i else target.turned(terms, normal)
    return sp4(terms, n, axes[i].h, w, dot(terms, n, v), sign).turn


def _ends(
    terms: Terms, axes: Sequence[Axis], target: Target, middle: CosSin
) -> tuple[Vector, Vector]:
    first, second, third = (axis for axis in axes if axis.turns)
    lever = rotated(terms, second.h, middle, subtracted(terms, third.p, second.p))
    w = subtracted(terms, added(terms, second.p, lever), first.p)
    return w, subtracted(terms, target.point(terms, third.p), first.p)


def _equal(terms: Terms, start: Vector, u: Vector, other: Vector, sign: sp.Expr) -> Vector:
    length = slide_to_sphere(terms, u, start, dot(terms, other, other), sign).length
    return combination(terms, (sp.Integer(1), length), (start, u))
