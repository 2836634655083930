"""Prismatic joints of an arm with parallel revolute axes.

The prismatic joint called lift moves along the parallel revolute axes. The prismatic joint called
telescope moves perpendicular to two of these axes, whose angle sum is known. The telescope changes
the length of one side of a triangle. The lengths of the two other sides of the triangle are known.
"""

import sympy as sp

from ...terms.vectors import Vector, combination, dot, subtracted
from ..structure.lines import Axis
from ..subproblems.slides import slide_to_plane, slide_to_sphere
from ..subproblems.sp1 import sp1
from ..subproblems.turns import CosSin, perpendicular, rotated
from .work import Work


def lift(work: Work, slide: Axis, first: Axis, hand: Vector, position: Vector) -> None:
    """Solve for the displacement of a prismatic joint along the parallel axes.

    Args:
        work: Records the step.
        slide: The prismatic joint.
        first: The first of the parallel axes.
        hand: The home position of a point that all joints move.
        position: Target position of the point ``hand``, relative to the first axis.
    """
    terms = work.terms
    reach = subtracted(terms, hand, first.p)
    work.slide(
        slide,
        "line-plane intersection",
        "the other joints do not move the tool along their axes",
        slide_to_plane(terms, first.h, slide.h, reach, dot(terms, first.h, position)),
    )


def telescope(
    work: Work, axes: tuple[Axis, ...], hand: Vector, position: Vector, total: CosSin
) -> None:
    """Solve for the telescope (a prismatic joint) and the first revolute joint.

    Args:
        work: Object that records the solution steps, to which the function adds two steps.
        axes: The two revolute axes and the telescope, in the order of the chain.
        hand: The home position of a point that all three joints move.
        position: Target position of the point `hand`, relative to the first revolute axis. The
            component of the target position along the axis has no effect.
        total: Cosine and sine of the sum of the two revolute angles.
    """
    terms = work.terms
    first, second = (axis for axis in axes if axis.turns)
    slide = next(axis for axis in axes if not axis.turns)
    place = axes.index(slide)
    lever = rotated(terms, first.h, total, subtracted(terms, hand, second.p))
    upper = perpendicular(terms, first.h, subtracted(terms, second.p, first.p))
    displacement = perpendicular(terms, first.h, subtracted(terms, position, lever))
    is_between = place == 1
    along = rotated(terms, first.h, total, slide.h) if place == len(axes) - 1 else slide.h
    # If the telescope is between the two revolute axes, its stroke is a part of the triangle side
    # between these axes. If the telescope is before or after both revolute axes, its stroke shifts
    # the required position of the second revolute axis.
    u = along if is_between else combination(terms, (sp.Integer(-1),), (along,))
    longer, other = (upper, displacement) if is_between else (displacement, upper)
    length = work.slide(
        slide,
        "line-sphere intersection",
        f"{first.name} does not change the distance between axes {first.name} and {second.name}",
        slide_to_sphere(terms, u, longer, dot(terms, other, other), work.sign()),
    )
    side = combination(terms, (sp.Integer(1), length), (longer, u))
    before, after = (side, displacement) if is_between else (upper, side)
    work.step(
        [first],
        "subproblem 1",
        f"this joint rotates axis {second.name} to its target position",
        sp1(terms, first.h, before, after),
        f"if this position is on axis {first.name}, the angle is arbitrary and set to 0",
    )
