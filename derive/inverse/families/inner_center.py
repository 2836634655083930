"""Six revolute joints. Axes 2, 3 and 4 intersect in one point inside the arm.

If the axes are numbered from the tool, axes 3, 4 and 5 intersect in one point. Maximum number of
solutions: 8.

Source: Elias and Wen 2022, table 1 (three consecutive intersecting axes).
"""

from dataclasses import replace

import sympy as sp

from ...terms.vectors import Vector, added, dot, subtracted
from ..steps.loop_of_three import loop_of_three, negative
from ..steps.rotations import three_turns
from ..steps.target import Target
from ..steps.two_joints import second_turn
from ..steps.work import Work
from ..steps.wrist_in_reach import is_straight, where_free
from ..structure.lines import Lines
from ..structure.requirement import Requirement, meeting, revolute
from ..subproblems.sp4 import sp4
from ..subproblems.turns import NO_TURN, CosSin, rotated
from .family import Family


def _requires(lines: Lines) -> list[Requirement]:
    return [revolute(lines, range(6)), meeting(lines, 1, 2, 3)]


def _solve(work: Work, lines: Lines, target: Target) -> None:
    terms = work.terms
    a1, a2, a3, a4, a5, a6 = lines.axes
    S = lines.meeting(1, 2)

    # 1 to 3. Joints 2 to 4 do not move the intersection point of their axes. Joint 1 moves the
    # intersection point relative to the base. Joints 5 and 6 move the intersection point relative
    # to the tool.
    if a1.stays or a6.stays:
        q1, q6, q5 = _two_of_three(work, lines, target, S)
    else:
        q1, q6, q5 = _three(work, lines, target, S)

    # 4 to 6. The remaining rotation.
    def left(v: Vector) -> Vector:
        v = rotated(terms, a6.h, q6.back, rotated(terms, a5.h, q5.back, v))
        return rotated(terms, a1.h, q1.back, target.turned(terms, v))

    three_turns(work, (a2, a3, a4), left)


def _two_of_three(
    work: Work, lines: Lines, target: Target, S: Vector
) -> tuple[CosSin, CosSin, CosSin]:
    terms, (a1, *_, a5, a6) = work.terms, lines.axes
    if a1.stays:
        fixed_axis, first, second = a1, a6.reversed(), a5.reversed()
        offset, reach = subtracted(terms, a5.p, a6.p), subtracted(terms, S, a5.p)
        wanted = subtracted(terms, target.reversed().point(terms, S), a6.p)
    else:
        # A displacement of the tool also displaces axis 5.
        fixed_axis, first, second = a6, replace(a5, h=target.turned(terms, a5.h)), a1
        offset = subtracted(terms, a1.p, target.point(terms, a5.p))
        reach = subtracted(terms, S, a1.p)
        wanted = target.turned(terms, subtracted(terms, S, a5.p))
    second_turn(work, first, second, offset, reach, wanted)
    work.turns[fixed_axis.joint] = NO_TURN
    q1, q6, q5 = (work.turns[axis.joint] for axis in (a1, a6, a5))
    return q1, q6, q5


def _three(work: Work, lines: Lines, target: Target, S: Vector) -> tuple[CosSin, CosSin, CosSin]:
    terms, (a1, a2, a3, a4, a5, a6) = work.terms, lines.axes
    back = target.reversed()
    arm = subtracted(terms, S, a1.p)
    found = loop_of_three(
        work,
        (a1, a6, a5),
        f"{a2.name}, {a3.name} and {a4.name} do not move the intersection of their axes",
        (
            subtracted(terms, back.point(terms, a1.p), a6.p),
            back.turned(terms, a1.h),
            back.turned(terms, arm),
        ),
        (negative(a6.h), subtracted(terms, a5.p, a6.p)),
        (negative(a5.h), subtracted(terms, S, a5.p)),
    )
    q1, q6, q5 = found
    q6 = _with_center_in_reach(lines, target, S, (q1, q6, q5))
    found = q1, q6, q5
    for axis, turn in zip((a1, a6, a5), found, strict=True):
        work.turns[axis.joint] = turn
    return found


def _with_center_in_reach(
    lines: Lines, target: Target, S: Vector, turns: tuple[CosSin, CosSin, CosSin]
) -> CosSin:
    """Return the angle of joint 6.

    If the pose does not determine angle 6, angle 6 is set to the value with the smallest
    orientation error. Joints 2 to 4 limit the angle between axes 4 and 2. The angle between axes 4
    and 2 is unlimited only if axis 3 is perpendicular to axes 2 and 4.
    """
    terms = lines.terms
    a1, a2, a3, a4, a5, a6 = lines.axes
    q1, q6, q5 = turns
    if is_straight(a2, a3) and is_straight(a3, a4):
        return q6
    there = added(terms, a5.p, rotated(terms, a5.h, q5.back, subtracted(terms, S, a5.p)))
    best = sp4(
        terms,
        target.reversed().turned(terms, rotated(terms, a1.h, q1, a2.h)),
        negative(a6.h),
        rotated(terms, a5.h, q5.back, a4.h),
        terms.let(dot(terms, a2.h, a3.h) * dot(terms, a3.h, a4.h)),
        sp.Integer(1),
    )
    return where_free(terms, a6.h, subtracted(terms, there, a6.p), q6, best.turn)


INNER_CENTER = Family("axes 2, 3 and 4 that intersect in one point", (6,), _requires, _solve)
