"""Replaces a chain with fixed joints by a shorter chain.

To obtain a chain without redundant joints, some joints of the arm are fixed. A fixed joint at an
end of the chain is removed, and the target is multiplied by the inverse of the joint's motion. The
motion of a fixed joint inside the chain is first moved to the end of the chain. Let E be the motion
of a fixed joint. Let P be the motion of all joints before the fixed joint, and Q the motion of all
joints after it. Then

    P E Q = P (E Q E^-1) E.

The motion of a fixed prismatic joint shifts the axes after this joint without rotating them. Inside
a chain, chasles itself therefore fixes only prismatic joints, but the user may also fix a revolute
joint.
"""

from collections.abc import Mapping
from dataclasses import replace
from itertools import combinations

import sympy as sp

from ..terms.terms import Terms
from ..terms.vectors import Vector, added, combination, subtracted
from .steps.target import Target
from .structure.lines import Axis, Lines, rotation
from .subproblems.turns import CosSin, rotated

LONG = 12
"""Maximum number of joints of a chain in which prismatic joints between free joints may be fixed.
"""


def joint_sets_to_fix(lines: Lines, count: int) -> set[tuple[int, ...]]:
    """Return every set of ``count`` joints that may be fixed in a chain.

    Args:
        lines: The chain.
        count: Number of joints to fix.

    Returns:
        Sets of joint indices in ascending order. Prismatic joints may be fixed anywhere in the
        chain, revolute joints only at its ends. In a chain longer than ``LONG``, all fixed joints
        are at the ends.
    """
    joints = range(len(lines.axes))
    sets = set()
    for first in range(count + 1):
        for last in range(count + 1 - first):
            inner = joints[first : len(joints) - last]
            slides = [k for k in inner if not lines.axes[k].turns and len(joints) <= LONG]
            ends = (*joints[:first], *joints[len(joints) - last :])
            between = combinations(slides, count - first - last)
            sets |= {tuple(sorted(ends + some)) for some in between}
    return {fixed for fixed in sets if len(fixed) < len(joints)}


def without(lines: Lines, target: Target, given: Mapping[int, sp.Expr]) -> tuple[Lines, Target]:
    """Return (chain of the free joints, target pose of this chain).

    Args:
        lines: The chain.
        target: Target pose of the chain with all joints.
        given: The value of each fixed joint (radian or meter), keyed by joint index. See
            ``joint_sets_to_fix``.
    """
    terms, axes = lines.terms, list(lines.axes)
    free = [k for k in range(len(axes)) if k not in given]
    for k in sorted(given):
        if k < free[0]:
            target = _without_first(terms, target, axes[k], given[k])
    for k in sorted(given, reverse=True):
        if k > free[-1]:
            target = _without_last(terms, target, axes[k], given[k])
    for k in sorted(given):
        if free[0] < k < free[-1]:
            axes[k + 1 :] = _moved(terms, axes[k], given[k], axes[k + 1 :])
            target = _without_last(terms, target, axes[k], given[k])
    return Lines(terms, tuple(axes[k] for k in free), lines.tolerance), target


def _without_first(terms: Terms, target: Target, axis: Axis, value: sp.Expr) -> Target:
    back = target.reversed()
    return _without_last(terms, back, axis.reversed(), value).reversed()


def _without_last(terms: Terms, target: Target, axis: Axis, value: sp.Expr) -> Target:
    if not axis.turns:
        return target.shifted(terms, combination(terms, (value,), (axis.h,)))
    return target.without_last(terms, axis.h, axis.p, CosSin(*terms.cos_sin(value)))


def _moved(terms: Terms, given: Axis, value: sp.Expr, behind: list[Axis]) -> list[Axis]:
    if not given.turns:
        by = combination(terms, (value,), (given.h,))
        return [_shifted(terms, axis, by, given) for axis in behind]
    turn = CosSin(*terms.cos_sin(value))
    return [_turned(terms, axis, turn, given) for axis in behind]


def _turned(terms: Terms, axis: Axis, turn: CosSin, given: Axis) -> Axis:
    """Return a joint axis, rotated by the angle of a fixed joint.

    The numeric direction and origin of the rotated axis are computed at one generic angle of the
    fixed joint.
    """
    h = axis.h if axis.is_along(given) else rotated(terms, given.h, turn, axis.h)
    lever = subtracted(terms, axis.p, given.p)
    p = added(terms, given.p, rotated(terms, given.h, turn, lever)) if axis.turns else axis.p
    R, origin = rotation(given.direction, given.some_motion), given.origin
    return replace(
        axis,
        h=h,
        p=p,
        direction=R @ axis.direction,
        origin=origin + R @ (axis.origin - origin),
    )


def _shifted(terms: Terms, axis: Axis, by: Vector, slid: Axis) -> Axis:
    """Return a joint axis, displaced by the translation of a fixed prismatic joint.

    The numeric origin of the axis is computed at one generic displacement of the fixed joint.
    """
    p = combination(terms, (sp.Integer(1), sp.Integer(1)), (axis.p, by))
    return replace(axis, p=p, origin=axis.origin + slid.some_motion * slid.direction)
