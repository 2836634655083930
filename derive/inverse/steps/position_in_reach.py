"""Joints whose motion does not change a height at some values of the fixed joints.

The height of a point along a revolute axis determines the value of a joint. If the angles between
the axes depend on fixed joints, a revolute joint may become parallel to the other axis, or a
prismatic joint perpendicular to it; the joint then does not change the height. The arm positions
the point in a plane, and any joint value is valid if the other joints reach the target. The
functions below then select a joint value at which the other joints reach the target.
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
    """Returns the displacement to a plane, or ``in_reach()`` if the joint moves along the plane.

    Args:
        terms: Table of named terms.
        found: The displacement that the plane determines.
        in_reach: Returns a displacement at which the other joints reach the target.
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
    """Returns the angle for a height, or ``in_reach()`` if the two axes are parallel.

    Args:
        terms: Table of named terms.
        axes: The direction of the height, and the axis of the angle.
        found: The angle that the height determines.
        in_reach: Returns an angle at which the other joints reach the target.
    """
    across = perpendicular(terms, *axes)
    if all(map(terms.is_constant, across)):
        return found
    are_parallel = dot(terms, across, across) <= terms.let(UNDETERMINED_SUM**2)
    turn = chosen(terms, are_parallel, in_reach(), found.turn)
    margin = found.margin and select(terms, are_parallel, sp.S.Zero, found.margin)
    return replace(found, turn=turn, margin=margin)


def hypotenuse2(terms: Terms, axis: Vector, *sides: Vector) -> sp.Expr:
    """Returns the sum of the squared lengths of vectors, measured perpendicular to an axis.

    The sum is the squared hypotenuse of two perpendicular links. If the elbow angle is adjustable,
    the links always reach a point at this distance.
    """
    flat = [perpendicular(terms, axis, side) for side in sides]
    return terms.let(sum((dot(terms, side, side) for side in flat), sp.S.Zero))


def slide_to_distance(
    terms: Terms, axis: Vector, slide: Vector, start: Vector, distance2: sp.Expr
) -> sp.Expr:
    """Returns the displacement that moves a point to a squared axis distance, or nearest to it.

    Args:
        terms: Table of named terms.
        axis: The direction of the axis.
        slide: The direction of the prismatic joint, perpendicular to the axis.
        start: The point relative to the axis.
        distance2: The squared distance.
    """
    flat = perpendicular(terms, axis, start)
    return slide_to_sphere(terms, slide, flat, distance2, sp.S.One).length
