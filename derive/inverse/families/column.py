"""An arm with a revolute column, two prismatic joints and a wrist.

The first wrist axis is parallel to the column.

Joints 2 and 3 are prismatic and have different directions. Axis 4 is parallel to axis 1, and axes 5
and 6 intersect. The prismatic joints do not rotate the tool. Joints 1 and 4 rotate the tool by the
sum of their angles. The tool orientation determines angles 5 and 6, and the sum of angles 1 and 4.
Axes 4, 5 and 6 need no common point. After the orientation is solved, joints 1 to 3 position the
wrist.

Maximum number of solutions: 4. The tool orientation and the wrist position have up to two solutions
each.
"""

import numpy as np

from ...model.tolerances import UNDETERMINED_SUM
from ...terms.terms import Terms
from ...terms.vectors import Vector, cross, dot, subtracted
from ..steps.rotations import last_turn
from ..steps.slides import two_slides
from ..steps.target import Target
from ..steps.work import Work
from ..structure.lines import Axis, Lines
from ..structure.requirement import Requirement, across, meeting, parallel, revolute
from ..subproblems.found import FoundTurn
from ..subproblems.quartic import select
from ..subproblems.sp1 import sp1
from ..subproblems.sp2 import sp2
from ..subproblems.sp4 import sp4
from ..subproblems.turns import CosSin, composed, perpendicular, rotated
from .family import Family


def _requires(lines: Lines) -> list[Requirement]:
    slides = not lines.axes[1].turns and not lines.axes[2].turns
    return [
        Requirement("joints 2 and 3 are prismatic", 0.0 if slides else np.inf),
        revolute(lines, (0, 3, 4, 5)),
        parallel(lines, 0, 3),
        meeting(lines, 4, 5),
        across(lines, 0, 1),
        _plane(lines),
    ]


def _plane(lines: Lines) -> Requirement:
    a1, a2, a3, *_ = (axis.direction for axis in lines.axes)
    return Requirement(
        "the prismatic joints move in a plane parallel to the column",
        abs(float(np.linalg.det([a1, a2, a3]))),
    )


def _solve(work: Work, lines: Lines, target: Target) -> None:
    terms = work.terms
    a1, a2, a3, a4, a5, a6 = lines.axes

    # 1 to 3. The tool orientation determines angles 5 and 6 and the sum of angles 1 and 4, because
    # axes 1 and 4 are parallel.
    center = lines.meeting(4, 5)
    meaning = "the common point of axes 5 and 6"
    wanted = work.name_vector(("W", "V"), meaning, target.point(terms, center))
    reach = subtracted(terms, center, a4.p)
    v = target.turned(terms, a6.h)
    found, _ = sp2(terms, a1.h, a5.h, a6.h, v, work.sign())
    q14_turn = work.step(
        [a1, a4],
        "subproblem 2",
        f"{a6.name} does not rotate its own axis, and {a1.name} and {a4.name} rotate it together",
        _far_from_the_column(terms, a1, found, v, reach, subtracted(terms, wanted, a1.p)),
        f"if axis {a6.name} is parallel to the column, the sum is arbitrary; it is set to the "
        f"value at which axis {a4.name} is farthest from the column",
    )
    seen = rotated(terms, a1.h, q14_turn.back, v)
    q5 = work.step(
        [a5],
        "subproblem 1",
        f"this joint produces the remaining rotation of axis {a6.name}",
        sp1(terms, a5.h, a6.h, seen),
    )
    e = cross(terms, a6.h, a5.h)
    last_turn(work, a6, e, target.turned(terms, e), ((a1, q14_turn), (a5, q5)), is_regular=True)

    # 4. Joint 1 rotates the plane of the prismatic joints to the target position of the wrist.
    lever = rotated(terms, a1.h, q14_turn, reach)
    V = subtracted(terms, subtracted(terms, wanted, lever), a1.p)
    normal = cross(terms, a1.h, a2.h)
    d = dot(terms, normal, subtracted(terms, a4.p, a1.p))
    q1 = work.step(
        [a1],
        "subproblem 4",
        "the prismatic joints do not move the wrist out of their plane",
        sp4(terms, V, a1.h, normal, d, work.sign()),
        f"if axis {a4.name} coincides with axis {a1.name}, the angle is arbitrary and set to 0",
    )
    work.turns[a4.joint] = composed(terms, q14_turn, q1.back).counted(
        1 if float(a1.direction @ a4.direction) > 0 else -1
    )

    work.remainder((a1, a4))

    # 5, 6. The prismatic joints 2 and 3 move the wrist in the plane of their two directions.
    displacement = subtracted(
        terms, rotated(terms, a1.h, q1.back, V), subtracted(terms, a4.p, a1.p)
    )
    two_slides(work, a2, a3, displacement)


def _far_from_the_column(
    terms: Terms, column: Axis, found: FoundTurn, v: Vector, reach: Vector, W: Vector
) -> FoundTurn:
    """Return the sum of angles 1 and 4.

    If the tool orientation does not determine the sum of angles 1 and 4, axis 4 is placed as far as
    possible from the column. Joint 1 can rotate axis 4 into the plane of the prismatic joints only
    if axis 4 is far enough from the column (axis 1).
    """
    x, y, z = W
    best = sp1(terms, column.h, reach, (-x, -y, -z)).turn
    across = perpendicular(terms, column.h, v)
    is_determined = dot(terms, across, across) > terms.let(UNDETERMINED_SUM**2)
    turn = CosSin(
        select(terms, is_determined, found.turn.c, best.c),
        select(terms, is_determined, found.turn.s, best.s),
    )
    return FoundTurn(turn, found.equation, found.sign, found.margin)


COLUMN = Family(
    "a revolute column, two prismatic joints and a wrist with axis 4 parallel to the column",
    (6,),
    _requires,
    _solve,
)
