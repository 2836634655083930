"""Six revolute joints, as in UR arms.

Axes 2, 3 and 4 are parallel, and axes 5 and 6 intersect.

Maximum number of solutions: 8.

Source: Elias and Wen 2022, 4.1 (2, 3, 4 parallel, 5-6 intersecting). The order of the solution
steps and the treatment of singularities do not come from the cited source.
"""

from ...terms.vectors import subtracted
from ..steps.elbow_in_reach import with_elbow_in_reach
from ..steps.plane import turn_to_plane
from ..steps.rotations import two_last_turns
from ..steps.target import Target
from ..steps.triangle import remaining, triangle
from ..steps.work import Work
from ..structure.lines import Lines
from ..structure.requirement import Requirement, meeting, parallel, revolute
from ..subproblems.sp2 import sp2
from ..subproblems.turns import rotated
from .family import Family


def _requires(lines: Lines) -> list[Requirement]:
    return [
        revolute(lines, range(6)),
        parallel(lines, 1, 2, 3),
        meeting(lines, 4, 5),
    ]


def _solve(work: Work, lines: Lines, target: Target) -> None:
    terms = work.terms
    a1, a2, a3, a4, a5, a6 = lines.axes
    center = lines.meeting(5, 4)

    # 1. Joints 5 and 6 do not move the intersection of their axes. Joints 2 to 4 move the
    # intersection of axes 5 and 6 perpendicular to axis 2, so only joint 1 moves it along axis 2.
    meaning = "the common point of axes 5 and 6"
    wanted = work.name_vector(("W", "V"), meaning, target.point(terms, center))
    U, q1 = turn_to_plane(
        work,
        a1,
        a2,
        center,
        wanted,
        "joints 2 to 6 do not move the common point of axes 5 and 6 along axes 2 to 4",
    )

    # 2. Joint 6 does not rotate its own axis.
    v = rotated(terms, a1.h, q1.back, target.turned(terms, a6.h))
    sign = work.sign()
    found, _ = sp2(terms, a2.h, a5.h, a6.h, v, sign)
    found = with_elbow_in_reach(work, lines, found, v, U, center, sign)
    q234 = work.step(
        [a2, a3, a4],
        "subproblem 2",
        "joint 6 does not rotate its own axis, and joints 2 to 4 rotate it together",
        found,
        "if axis 6 is parallel to axes 2 to 4, the sum is arbitrary; it is set to the value at "
        "which the elbow is nearest to a right angle",
    )

    # 3 and 4. The remaining rotation.
    regular = found.margin is None
    two_last_turns(work, ((a1, q1), (a2, q234)), (a5, a6), target, is_regular=regular)

    # 5. Shoulder, elbow and wrist form a triangle in the plane normal to the parallel axes.
    lever = rotated(terms, a2.h, q234, subtracted(terms, center, a4.p))
    triangle(work, a2, a3, a4.p, subtracted(terms, U, lever))
    remaining(work, (a2, a3, a4), q234)


THREE_PARALLEL = Family(
    "three parallel axes 2, 3, 4 and intersecting axes 5, 6", (6,), _requires, _solve
)
