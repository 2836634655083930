"""Six revolute joints, axes 2, 3 and 4 meeting in one point: a sphere in the middle of the arm.

Read from the tool, these are the arms whose axes 3, 4 and 5 meet. Most solutions: 8.

Source: Elias and Wen 2022, table 1 (three consecutive intersecting axes).
"""

from ...terms.vectors import Vector, subtracted
from ..steps.loop_of_three import loop_of_three, negative
from ..steps.rotations import three_turns
from ..steps.target import Target
from ..steps.work import Work
from ..structure.lines import Lines
from ..structure.requirement import Requirement, meeting, revolute
from ..subproblems.turns import rotated
from .family import Family


def _requires(lines: Lines) -> list[Requirement]:
    return [revolute(lines, range(6)), meeting(lines, 1, 2, 3)]


def _solve(work: Work, lines: Lines, target: Target) -> None:
    terms = work.terms
    a1, a2, a3, a4, a5, a6 = lines.axes
    back = target.reversed()
    S = lines.meeting(1, 2)

    # 1 to 3. Joints 2 to 4 do not move their common point: joint 1 and, from the tool, joints 6 and
    #    5 bring it to the same position.
    arm = subtracted(terms, S, a1.p)
    found = loop_of_three(
        work,
        (a1, a6, a5),
        f"{a2.name}, {a3.name} and {a4.name} do not move the point where their axes meet",
        (
            subtracted(terms, back.point(terms, a1.p), a6.p),
            back.turned(terms, a1.h),
            back.turned(terms, arm),
        ),
        (negative(a6.h), subtracted(terms, a5.p, a6.p)),
        (negative(a5.h), subtracted(terms, S, a5.p)),
    )
    q1, q6, q5 = found
    for axis, turn in zip((a1, a6, a5), found, strict=True):
        work.turns[axis.joint] = turn

    # 4 to 6. The rest of the rotation.
    def left(v: Vector) -> Vector:
        v = rotated(terms, a6.h, q6.back, rotated(terms, a5.h, q5.back, v))
        return rotated(terms, a1.h, q1.back, target.turned(terms, v))

    three_turns(work, (a2, a3, a4), left)


INNER_CENTRE = Family("axes 2, 3 and 4 through one point", (6,), _requires, _solve)
