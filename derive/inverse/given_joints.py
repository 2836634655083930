"""Joints whose values are given: the chain and the target that remain without them.

A redundant arm is solved for given values of its surplus joints. A joint at either end is taken out
by inverting its motion. A joint in between displaces everything behind it, after which its motion
can be inverted at the end: with E the motion of joint k, P that of the joints before it and Q that
of the joints behind it,

    P E Q = P (E Q E^-1) E.

A slide shifts the axes behind it without turning them, so that slides alone are chosen here as
given joints in between; a turning joint is taken out where the user asks for it.
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
"""In a chain of more joints no slides in between are tried: the choices would be too many."""


def ways_to_give(lines: Lines, count: int) -> set[tuple[int, ...]]:
    """The sets of joints that can be given: joints at the ends of the chain, and slides in between.

    Args:
        lines: The chain.
        count: Number of joints to be given.

    Returns:
        Their indices in ascending order. A chain longer than ``LONG`` gets no slides in between.
    """
    joints = range(len(lines.axes))
    ways = set()
    for first in range(count + 1):
        for last in range(count + 1 - first):
            inner = joints[first : len(joints) - last]
            slides = [k for k in inner if not lines.axes[k].turns and len(joints) <= LONG]
            ends = (*joints[:first], *joints[len(joints) - last :])
            between = combinations(slides, count - first - last)
            ways |= {tuple(sorted(ends + some)) for some in between}
    return {way for way in ways if len(way) < len(joints)}


def without(lines: Lines, target: Target, given: Mapping[int, sp.Expr]) -> tuple[Lines, Target]:
    """The chain and the target that remain for the other joints.

    Args:
        lines: The chain.
        target: Its target.
        given: The value of each given joint (radian or metre), by its index in the chain; see
            :func:`ways_to_give`.
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
    """The axes behind a given joint, displaced by its motion."""
    if not given.turns:
        by = combination(terms, (value,), (given.h,))
        return [_shifted(terms, axis, by, given) for axis in behind]
    turn = CosSin(*terms.cos_sin(value))
    return [_turned(terms, axis, turn, given) for axis in behind]


def _turned(terms: Terms, axis: Axis, turn: CosSin, given: Axis) -> Axis:
    """The axis after a given turn; its numbers are those after one turn in general position."""
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
    """The axis after a given slide; its position in numbers is that after one slide."""
    p = combination(terms, (sp.Integer(1), sp.Integer(1)), (axis.p, by))
    return replace(axis, p=p, origin=axis.origin + slid.some_motion * slid.direction)
