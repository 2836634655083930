"""The slides of an arm with parallel axes: along them, and across two of them.

A slide across two axes, a telescope, brings a point to its position in the plane with the first of
them. The sum of the two angles is known, so that a triangle remains of which two sides are given
and the slide changes the third.
"""

import sympy as sp

from ...terms.vectors import Vector, combination, dot, subtracted
from ..structure.lines import Axis
from ..subproblems.slides import slide_to_plane, slide_to_sphere
from ..subproblems.sp1 import sp1
from ..subproblems.turns import CosSin, perpendicular, rotated
from .work import Work


def lift(work: Work, slide: Axis, first: Axis, hand: Vector, position: Vector) -> None:
    """Finds a slide along parallel axes, which alone moves the tool along them.

    Args:
        work: Gathers the step.
        slide: The slide.
        first: The first of the parallel axes.
        hand: A point that all joints move, in the home pose.
        position: The wanted position of the point relative to that axis.
    """
    terms = work.terms
    reach = subtracted(terms, hand, first.p)
    work.slide(
        slide,
        "a line meets a plane",
        "the other joints do not move the tool along their axes",
        slide_to_plane(terms, first.h, slide.h, reach, dot(terms, first.h, position)),
    )


def telescope(
    work: Work, axes: tuple[Axis, ...], hand: Vector, position: Vector, total: CosSin
) -> None:
    """Finds the slide and the first of the two turns.

    Args:
        work: Gathers the two steps.
        axes: The two revolute axes and the slide, in the order of the chain.
        hand: A point that all three move, in the home pose.
        position: The wanted position of the point relative to the first revolute axis; its part
            along this axis has no effect.
        total: The turn by the sum of the revolute joints, counted about the first.
    """
    terms = work.terms
    first, second = (axis for axis in axes if axis.turns)
    slide = next(axis for axis in axes if not axis.turns)
    place = axes.index(slide)
    lever = rotated(terms, first.h, total, subtracted(terms, hand, second.p))
    upper = perpendicular(terms, first.h, subtracted(terms, second.p, first.p))
    way = perpendicular(terms, first.h, subtracted(terms, position, lever))
    is_between = place == 1
    along = rotated(terms, first.h, total, slide.h) if place == len(axes) - 1 else slide.h
    # The slide lengthens the side between the axes, else it shortens the way that is left to it.
    u = along if is_between else combination(terms, (sp.Integer(-1),), (along,))
    longer, other = (upper, way) if is_between else (way, upper)
    length = work.slide(
        slide,
        "a line meets a sphere",
        f"{first.name} keeps the distance of axis {second.name}",
        slide_to_sphere(terms, u, longer, dot(terms, other, other), work.sign()),
    )
    side = combination(terms, (sp.Integer(1), length), (longer, u))
    before, after = (side, way) if is_between else (upper, side)
    work.step(
        [first],
        "subproblem 1",
        f"it turns axis {second.name} to its position",
        sp1(terms, first.h, before, after),
        f"with this position on axis {first.name} the angle is arbitrary and taken as 0",
    )
