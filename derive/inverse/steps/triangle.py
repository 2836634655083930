"""Two parallel axes that bring a point to a place across them: shoulder, elbow and hand.

Every family with parallel axes ends here.
"""

from ...terms.vectors import Vector, added, dot, subtracted
from ..structure.lines import Axis
from ..subproblems.sp1 import sp1
from ..subproblems.sp3 import sp3
from ..subproblems.turns import CosSin, composed, perpendicular, rotated
from .work import Sum, Work


def triangle(work: Work, first: Axis, second: Axis, hand: Vector, place: Vector) -> None:
    """Finds two joints from three sides: the elbow's bend, then the direction of the bent arm.

    Args:
        work: Gathers the two steps.
        first: The shoulder's axis.
        second: The elbow's, parallel to it.
        hand: A point that both move, in the home pose.
        place: Where it is to come, seen from the shoulder's axis; only what lies across it counts.
    """
    terms = work.terms
    upper = perpendicular(terms, first.h, subtracted(terms, second.p, first.p))
    fore = perpendicular(terms, first.h, subtracted(terms, hand, second.p))
    way = perpendicular(terms, first.h, place)
    bent = work.step(
        [second],
        "subproblem 3",
        f"it is bent by the distance to be reached from axis {first.name}",
        sp3(terms, second.h, upper, fore, dot(terms, way, way), work.sign()),
    )
    arm = added(terms, upper, rotated(terms, second.h, bent, fore))
    work.step(
        [first],
        "subproblem 1",
        "the bent arm points to where it is to reach",
        sp1(terms, first.h, arm, way),
        f"with that place on axis {first.name} every angle will do; it is then 0",
    )


def remaining(work: Work, axes: tuple[Axis, ...], total: CosSin) -> None:
    """The angle of the last of parallel axes, from the sum of all and the angles of the others.

    The sum counts about the first axis.
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
