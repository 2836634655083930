"""Six revolute joints, axes 2, 3 and 4 parallel, whatever axes 5 and 6 are.

What axes 2 to 4 leave alone, the parts of axis 6 and of a point of it along their direction, are
two equations for angles 1 and 5 together: subproblem 6. The rest is as in :mod:`.three_parallel`,
which is tried first. Most solutions: 8.

Source: Elias and Wen 2022, 4.1 (2, 3, 4 parallel).
"""

import sympy as sp

from ...scope import Scope
from ...vectors import Vector, added, cross, dot, subtracted
from ..found import FoundTurn, Simultaneous
from ..lines import Lines
from ..requirement import Requirement, askew, parallel, revolute
from ..subproblems.sp1 import sp1
from ..subproblems.sp6 import sp6
from ..target import Target
from ..turns import any_across, perpendicular, rotated
from ..work import Work
from .loop import negative
from .three_parallel import reaching
from .triangle import remaining, triangle

TITLE = "three parallel axes 2, 3, 4"


def requires(lines: Lines) -> list[Requirement]:
    """What the axes must fulfil."""
    return [
        revolute(lines, range(6)),
        parallel(lines, 1, 2, 3),
        askew(lines, 0, 1),
        askew(lines, 4, 1),
    ]


def solve(work: Work, lines: Lines, target: Target) -> None:
    """All six angles for a target."""
    scope = work.scope
    a1, a2, a3, a4, a5, a6 = lines.axes
    h = a2.h

    # 1, 2. Joints 2 to 4 change no part along their direction: neither that of axis 6 nor that of
    #    its place.
    W = subtracted(scope, target.point(scope, a6.p), a1.p)
    v = target.turned(scope, a6.h)
    reach = subtracted(scope, a6.p, a5.p)
    still = dot(scope, h, subtracted(scope, a5.p, a1.p))
    rows = [
        _row(scope, h, (negative(a1.h), W), (a5.h, reach), still),
        _row(scope, h, (negative(a1.h), v), (a5.h, a6.h), sp.Integer(0)),
    ]
    signs = work.sign(), work.sign()
    (A1, B1, b1), (A2, B2, b2) = rows
    found = sp6(scope, (A1, A2), (B1, B2), (b1, b2), signs)
    equation = Simultaneous(6, (("A_1", (*A1, *A2)), ("A_2", (*B1, *B2)), ("b", (b1, b2))))
    for axis, turn in ((a1, found.first), (a5, found.second)):
        work.step(
            [axis],
            "subproblem 6",
            "joints 2 to 4 change no part along their axes, neither of axis 6 nor of its place",
            FoundTurn(turn, equation, signs[0], found.margin),
        )
    q1, q5 = found.first, found.second

    # 3. Joints 2 to 4 turn axis 6 as one.
    U = added(scope, rotated(scope, a1.h, q1.back, W), subtracted(scope, a1.p, a2.p))
    seen = rotated(scope, a1.h, q1.back, v)
    carried = rotated(scope, a5.h, q5, a6.h)
    hand = added(scope, a5.p, rotated(scope, a5.h, q5, reach))
    told = reaching(work, lines, sp1(scope, h, carried, seen), seen, U, hand, signs[1])
    q234 = work.step(
        [a2, a3, a4],
        "subproblem 1",
        "joints 2 to 4 turn axis 6 as one",
        told,
        "with axis 6 parallel to axes 2 to 4 every sum will do; it is then the one that brings the "
        "elbow nearest to a right angle",
    )

    # 4. Any direction across axis 6 tells the last angle.
    e = any_across(scope, a6.h)
    left = rotated(scope, a1.h, q1.back, target.turned(scope, e))
    left = rotated(scope, a5.h, q5.back, rotated(scope, h, q234.back, left))
    work.step(
        [a6],
        "subproblem 1",
        "what joints 1 to 5 leave of the turn",
        sp1(scope, a6.h, e, left, sure=True),
    )

    # 5. The rest is a triangle across the parallel axes: shoulder, elbow, wrist.
    lever = rotated(scope, h, q234, subtracted(scope, hand, a4.p))
    triangle(work, a2, a3, a4.p, subtracted(scope, U, lever))
    remaining(work, (a2, a3, a4), q234)


def _row(
    scope: Scope,
    h: Vector,
    left: tuple[Vector, Vector],
    right: tuple[Vector, Vector],
    still: sp.Expr,
) -> tuple[tuple[sp.Expr, sp.Expr], tuple[sp.Expr, sp.Expr], sp.Expr]:
    """``h . R(k1) p1 = still + h . R(k2) p2`` as coefficients of (sin, cos) and a right side."""
    (k1, p1), (k2, p2) = left, right
    along = [scope.let(dot(scope, h, k) * dot(scope, k, p)) for k, p in (left, right)]
    A = dot(scope, h, cross(scope, k1, p1)), dot(scope, h, perpendicular(scope, k1, p1))
    B = dot(scope, h, cross(scope, k2, p2)), dot(scope, h, perpendicular(scope, k2, p2))
    return A, (-B[0], -B[1]), scope.let(still + along[1] - along[0])
