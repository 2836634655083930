"""The first axis turns the plane across the second: where every arm with a turntable begins."""

from ...terms.vectors import Vector, added, dot, subtracted
from ..structure.lines import Axis
from ..subproblems.sp4 import sp4
from ..subproblems.turns import CosSin, rotated
from .work import Work


def turn_to_plane(
    work: Work, first: Axis, second: Axis, carried: Vector, place: Vector, reason: str
) -> tuple[Vector, CosSin]:
    """Finds the first joint of those of which no other moves a point along the second axis.

    Args:
        work: Gathers the step.
        first: The axis of the joint that is found.
        second: The axis along which only the first joint moves the point.
        carried: The point in the home pose.
        place: Where it is to come.
        reason: Why no other joint moves it that way, in words.

    Returns:
        The place as the first joint leaves it, seen from the second axis; and the joint's turn.
    """
    terms = work.terms
    V = subtracted(terms, place, first.p)
    d = dot(terms, second.h, subtracted(terms, carried, first.p))
    turn = work.step(
        [first],
        "subproblem 4",
        reason,
        sp4(terms, V, first.h, second.h, d, work.sign()),
        "with the point on the first axis every angle will do; it is then 0",
    )
    seen = rotated(terms, first.h, turn.back, V)
    return added(terms, seen, subtracted(terms, first.p, second.p)), turn
