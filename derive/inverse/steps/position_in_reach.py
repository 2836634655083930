"""Selects the value of a joint that the target position does not determine.

The target position fails to determine the joint value only at special values of the fixed joints.

In general, the height of a point along a revolute axis h determines the value of one joint. The
angle between the axis of this joint and h may depend on fixed joints. A revolute joint parallel to
h or a prismatic joint perpendicular to h does not change the height of the point. A joint without
effect on the height may have any value at which the other joints reach the target in the plane
perpendicular to h. The functions of this module select such a joint value.
"""

from collections.abc import Callable
from dataclasses import replace

import sympy as sp

from ...model.tolerances import UNDETERMINED_SUM
from ...terms.terms import Terms
from ...terms.vectors import Vector, dot
from ..subproblems.equations import LineAndPlane
from ..subproblems.found import FoundLength, FoundTurn
from ..subproblems.quartic import select
from ..subproblems.slides import slide_to_sphere
from ..subproblems.sp6 import chosen
from ..subproblems.turns import CosSin, perpendicular


def slide_in_reach(
    terms: Terms, found: FoundLength, in_reach: Callable[[], sp.Expr]
) -> FoundLength:
    """Return the displacement by which a prismatic joint moves a point into a plane.

    If the prismatic joint is parallel to the plane, ``in_reach()`` is returned.

    Args:
        terms: Table of named terms.
        found: The displacement that solves the equation of the plane.
        in_reach: Function that returns a displacement of the prismatic joint at which the other
            joints reach the target.
    """
    assert isinstance(found.equation, LineAndPlane)
    rate = found.equation.rate
    if terms.is_constant(rate):
        return found
    is_flat = terms.let(rate**2) <= terms.let(UNDETERMINED_SUM**2)
    return replace(found, length=select(terms, is_flat, in_reach(), found.length))


def turn_in_reach(
    terms: Terms, axes: tuple[Vector, Vector], found: FoundTurn, in_reach: Callable[[], CosSin]
) -> FoundTurn:
    """Return the joint angle that gives a point a required height along a direction.

    If the joint axis is parallel to the direction, ``in_reach()`` is returned.

    Args:
        terms: Table of named terms.
        axes: The direction along which the height is measured, and the axis of the joint.
        found: The joint angle at which the point has the required height.
        in_reach: Function that returns a joint angle at which the other joints reach the target.
    """
    across = perpendicular(terms, *axes)
    if all(map(terms.is_constant, across)):
        return found
    are_parallel = dot(terms, across, across) <= terms.let(UNDETERMINED_SUM**2)
    turn = chosen(terms, are_parallel, in_reach(), found.turn)
    margin = found.margin and select(terms, are_parallel, sp.S.Zero, found.margin)
    return replace(found, turn=turn, margin=margin)


def hypotenuse2(terms: Terms, axis: Vector, *sides: Vector) -> sp.Expr:
    """Sum the squared lengths of link vectors, without their components along an axis.

    For two links at a right angle, the square root of the returned sum is the distance between the
    outer ends of the links. The two links can always reach a point at this distance if the elbow
    angle is free.
    """
    flat = [perpendicular(terms, axis, side) for side in sides]
    return terms.let(sum((dot(terms, side, side) for side in flat), sp.S.Zero))


def slide_to_distance(
    terms: Terms, axis: Vector, slide: Vector, start: Vector, distance2: sp.Expr
) -> sp.Expr:
    """Return the displacement that brings a point to a given distance from an axis.

    If this distance is unreachable, the point comes as close as possible to the axis.

    Args:
        terms: Table of named terms.
        axis: The direction of the axis.
        slide: The direction of the prismatic joint, which is perpendicular to the axis.
        start: The point relative to the axis.
        distance2: The squared distance of the point from the axis.
    """
    flat = perpendicular(terms, axis, start)
    return slide_to_sphere(terms, slide, flat, distance2, sp.S.One).length
