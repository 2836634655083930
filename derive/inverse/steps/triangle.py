"""Solves for two parallel revolute joints that position a point in a plane.

Shoulder, elbow and wrist are the corners of a triangle in the plane normal to the axes.
"""

from ...terms.vectors import Vector, added, dot, subtracted
from ..structure.lines import Axis
from ..subproblems.sp1 import sp1
from ..subproblems.sp3 import sp3
from ..subproblems.turns import CosSin, composed, perpendicular, rotated
from .work import Sum, Work


def triangle(work: Work, first: Axis, second: Axis, hand: Vector, position: Vector) -> None:
    """Solve for the elbow angle, then for the shoulder angle, from the sides of a triangle.

    Args:
        work: Object that records the two solution steps.
        first: The shoulder axis.
        second: The elbow axis, parallel to the shoulder axis.
        hand: Home position of a tool point that both joints move.
        position: Target position of the point `hand`, relative to the shoulder axis. The component
            of the target along the shoulder axis has no effect on the angles.
    """
    terms = work.terms
    upper = perpendicular(terms, first.h, subtracted(terms, second.p, first.p))
    fore = perpendicular(terms, first.h, subtracted(terms, hand, second.p))
    displacement = perpendicular(terms, first.h, position)
    bent = work.step(
        [second],
        "subproblem 3",
        f"the distance of the target position from axis {first.name} determines this angle by the "
        "law of cosines",
        sp3(terms, second.h, upper, fore, dot(terms, displacement, displacement), work.sign()),
    )
    arm = added(terms, upper, rotated(terms, second.h, bent, fore))
    work.step(
        [first],
        "subproblem 1",
        "this joint rotates the bent arm to the target position",
        sp1(terms, first.h, arm, displacement),
        f"if this position is on axis {first.name}, the angle is arbitrary and set to 0",
    )


def remaining(work: Work, axes: tuple[Axis, ...], total: CosSin) -> None:
    """Solve for the last of several parallel joints, given the sum of all joint angles.

    Args:
        work: Object that records the solution steps, to which the function adds the step for the
            last joint.
        axes: The parallel axes.
        total: Rotation about the first axis by the sum of all joint angles.
    """
    first, *others, last = axes
    before = work.turns[first.joint]
    for axis in others:
        before = composed(work.terms, before, work.turns[axis.joint].counted(_sense(first, axis)))
    left = composed(work.terms, total, before.back)
    work.turns[last.joint] = left.counted(_sense(first, last))
    senses = tuple((axis.joint, _sense(first, axis)) for axis in axes)
    work.sums.append(Sum(senses, total))
    work.remainder(axes)


def _sense(a: Axis, b: Axis) -> int:
    return 1 if float(a.direction @ b.direction) > 0 else -1
