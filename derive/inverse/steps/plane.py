"""The first step of an arm behind a turntable: the angle that turns its plane to a point."""

from ...terms.vectors import Vector, added, dot, subtracted
from ..structure.lines import Axis
from ..subproblems.sp4 import sp4
from ..subproblems.turns import CosSin, rotated
from .work import Work


def turn_to_plane(
    work: Work, first: Axis, second: Axis, carried: Vector, position: Vector, reason: str
) -> tuple[Vector, CosSin]:
    """Finds the first joint's angle where no other joint moves a point along the second axis.

    Args:
        work: Gathers the step.
        first: The axis of this joint.
        second: The axis along which only the first joint moves the point.
        carried: The point in the home pose.
        position: The wanted position of the point.
        reason: Why no other joint moves the point along the second axis, in words.

    Returns:
        The wanted position turned back by the first joint, relative to the second axis, and the
        joint's turn.
    """
    terms = work.terms
    V = subtracted(terms, position, first.p)
    d = dot(terms, second.h, subtracted(terms, carried, first.p))
    turn = work.step(
        [first],
        "subproblem 4",
        reason,
        sp4(terms, V, first.h, second.h, d, work.sign()),
        "with the point on the first axis the angle is arbitrary and taken as 0",
    )
    seen = rotated(terms, first.h, turn.back, V)
    return added(terms, seen, subtracted(terms, first.p, second.p)), turn
