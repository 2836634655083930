"""Solution of a loop of three vectors for three angles (subproblem 5)."""

from ...terms.vectors import Vector
from ..structure.lines import Axis
from ..subproblems.equations import LoopOfThree
from ..subproblems.found import FoundTurn
from ..subproblems.sp5 import sp5
from ..subproblems.turns import CosSin
from .work import Work


def loop_of_three(
    work: Work,
    axes: tuple[Axis, Axis, Axis],
    reason: str,
    first: tuple[Vector, Vector, Vector],
    second: tuple[Vector, Vector],
    third: tuple[Vector, Vector],
) -> tuple[CosSin, CosSin, CosSin]:
    """Solve ``p0 + R(k1) p1 = R(k2) (p2 + R(k3) p3)`` for three angles, with up to four solutions.

    Args:
        work: Records the steps.
        axes: The axes of the three joints.
        reason: Reason why the loop equation contains only the angles of k1, k2 and k3.
        first: The vector p0, the axis k1 and the vector p1.
        second: The axis k2 and the vector p2.
        third: The axis k3 and the vector p3.
    """
    signs = work.sign(), work.sign()
    found = sp5(work.terms, *first, *second, *third, signs)
    equation = LoopOfThree(*first, *second, *third)
    turns = (found.first, found.second, found.third)
    for axis, turn in zip(axes, turns, strict=True):
        work.note(
            (axis.name,),
            "subproblem 5",
            reason,
            FoundTurn(turn, equation, signs[0], found.margin),
        )
    return turns


def negative(v: Vector) -> Vector:
    """Return the opposite vector."""
    x, y, z = v
    return -x, -y, -z
