"""Six revolute joints, axes 2, 3 and 4 parallel, axes 5 and 6 meeting: the arms of UR and kin.

Most solutions: 8.

Source: Elias and Wen 2022, 4.1 (2, 3, 4 parallel, 5-6 intersecting); the order of the steps and
what is done at the singularities are ours.
"""

import sympy as sp

from ...terms.vectors import Vector, cross, dot, subtracted
from ..steps.plane import turn_to_plane
from ..steps.target import Target
from ..steps.triangle import remaining, triangle
from ..steps.work import Work
from ..structure.lines import Lines
from ..structure.requirement import Requirement, meeting, parallel, revolute
from ..subproblems.found import FoundTurn
from ..subproblems.sp1 import sp1
from ..subproblems.sp2 import sp2
from ..subproblems.sp3 import sp3
from ..subproblems.turns import Turn, perpendicular, rotated

TITLE = "three parallel axes 2, 3, 4 and intersecting axes 5, 6"
MOST_SOLUTIONS = 8
UNDETERMINED = sp.Float("5e-10", 20)
"""Up to this sine of the angle between axis 6 and axes 2 to 4, the three are taken for parallel.

The sum of the angles 2 to 4 is then free to bring the elbow within reach, at the cost of an
orientation that is off by no more than this.
"""


def requires(lines: Lines) -> list[Requirement]:
    """What the axes must fulfil."""
    return [
        revolute(lines, range(6)),
        parallel(lines, 1, 2, 3),
        meeting(lines, 4, 5),
    ]


def solve(work: Work, lines: Lines, target: Target) -> None:
    """All six angles for a target."""
    terms = work.terms
    a1, a2, a3, a4, a5, a6 = lines.axes
    centre = lines.meeting(5, 4)

    # 1. Joints 5 and 6 leave their common point where it is, and joints 2 to 4 move it across h_2
    #    only: its part along h_2 is joint 1's affair alone.
    place = work.call("W", "the common point of axes 5 and 6", target.point(terms, centre))
    U, q1 = turn_to_plane(
        work,
        a1,
        a2,
        centre,
        place,
        "joints 2 to 6 do not move the common point of axes 5 and 6 along axes 2 to 4",
    )

    # 2. Joint 6 does not turn its own axis. 3. The second angle belongs to the first.
    v = rotated(terms, a1.h, q1.back, target.turned(terms, a6.h))
    sign = work.sign()
    found, _ = sp2(terms, a2.h, a5.h, a6.h, v, sign)
    found = reaching(work, lines, found, v, U, centre, sign)
    q234 = work.step(
        [a2, a3, a4],
        "subproblem 2",
        "joint 6 does not turn its own axis, and joints 2 to 4 turn it as one",
        found,
        "with axis 6 parallel to axes 2 to 4 every sum will do; it is then the one that brings the "
        "elbow nearest to a right angle",
    )
    seen = rotated(terms, a2.h, q234.back, v)
    q5 = work.step(
        [a5],
        "subproblem 1",
        "what joints 1 to 4 leave of the turn of axis 6",
        sp1(terms, a5.h, a6.h, seen, sure=found.margin is None),
    )

    # 4. Any direction across axis 6 tells the last angle.
    e = cross(terms, a6.h, a5.h)
    left = rotated(terms, a1.h, q1.back, target.turned(terms, e))
    left = rotated(terms, a5.h, q5.back, rotated(terms, a2.h, q234.back, left))
    work.step(
        [a6],
        "subproblem 1",
        "what joints 1 to 5 leave of the turn",
        sp1(terms, a6.h, e, left, sure=True),
    )

    # 5. The rest is a triangle across the parallel axes: shoulder, elbow, wrist.
    lever = rotated(terms, a2.h, q234, subtracted(terms, centre, a4.p))
    triangle(work, a2, a3, a4.p, subtracted(terms, U, lever))
    remaining(work, (a2, a3, a4), q234)


def reaching(
    work: Work,
    lines: Lines,
    found: FoundTurn,
    v: Vector,
    U: Vector,
    centre: Vector,
    sign: sp.Symbol,
) -> FoundTurn:
    """The sum of angles 2 to 4, and where v does not tell it the one that the elbow likes best.

    Args:
        work: Names of all terms.
        lines: The chain.
        found: The sum as axis 6 tells it.
        v: Axis 6 as joint 1 leaves it.
        U: The hand's place as joint 1 leaves it, seen from axis 2.
        centre: The hand, with joints 1 to 4 at 0.
        sign: Chooses among two sums that the elbow likes equally.
    """
    terms = work.terms
    _, a2, a3, a4, _, _ = lines.axes
    lever = perpendicular(terms, a2.h, subtracted(terms, centre, a4.p))
    minus_U = subtracted(terms, (sp.Integer(0),) * 3, perpendicular(terms, a2.h, U))
    upper = perpendicular(terms, a2.h, subtracted(terms, a3.p, a2.p))
    fore = perpendicular(terms, a2.h, subtracted(terms, a4.p, a3.p))
    right = terms.let(dot(terms, upper, upper) + dot(terms, fore, fore))
    best = sp3(terms, a2.h, minus_U, lever, right, sign).turn
    across = perpendicular(terms, a2.h, v)
    told = dot(terms, across, across) > terms.let(UNDETERMINED**2)
    turn = Turn(
        terms.let(sp.Piecewise((found.turn.c, told), (best.c, True), evaluate=False)),
        terms.let(sp.Piecewise((found.turn.s, told), (best.s, True), evaluate=False)),
    )
    return FoundTurn(turn, found.equation, found.sign, found.margin)
