"""Solves for three joints that position a point, as before a spherical wrist.

The joint values q_k satisfy ``exp(S_1 q_1) exp(S_2 q_2) exp(S_3 q_3) C = W`` with joint screws S_k,
a point C and its target W. The solution uses quantities that a revolute joint does not change: a
point's component along the axis, or its distance from a point on the axis.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import sympy as sp

from ...model.tolerances import OBLIQUE_AXES
from ...terms.vectors import Vector, added, combination, dot, subtracted
from ..structure.lines import Axis, Lines
from ..structure.requirement import Requirement, across, askew, meeting, parallel
from ..subproblems.slides import slide_to_plane, slide_to_sphere
from ..subproblems.sp1 import sp1
from ..subproblems.sp2 import sp2
from ..subproblems.sp3 import by_cosine, sp3, squared_across
from ..subproblems.sp4 import sp4
from ..subproblems.turns import CosSin, perpendicular, rotated
from .loop_of_three import loop_of_three, negative
from .one_turn import (
    rises,
    slide_turn_slide,
    slides_then_turn,
    turn_slide_parallel_turn,
    turn_slide_turn,
    turn_then_slides,
)
from .plane import turn_to_plane
from .position_in_reach import hypotenuse2, slide_in_reach, slide_to_distance, turn_in_reach
from .slides import slides
from .triangle import triangle
from .work import Work

Solver = Callable[[Work, Lines, Vector, Vector], None]
"""Type of a function that solves for the values of three joints that move a point to its target W.
"""


@dataclass(frozen=True)
class Case:
    """An arrangement of three joints that has a closed-form solution.

    Attributes:
        kinds: One letter per joint: r for revolute, p for prismatic.
        title: The arrangement in words, such as "axes 2 and 3 are parallel".
        max_solutions: The maximum number of solutions.
        requires: Function that returns the conditions that the arrangement imposes on the joint
            axes.
        solve: Function that solves for the values of the three joints.
    """

    kinds: str
    title: str
    max_solutions: int
    requires: Callable[[Lines], list[Requirement]]
    solve: Solver


def case_of(lines: Lines) -> Case | None:
    """Return the first arrangement of ``CASES`` that fits the three axes, or None."""
    kinds = _kinds(lines)
    for case in CASES:
        if case.kinds == kinds and _worst(case, lines).deviation <= lines.tolerance:
            return case
    return None


def requires(lines: Lines) -> Requirement:
    """Return the conditions of the first arrangement of axes that fits the chain.

    If no arrangement fits the chain, the conditions of the nearest arrangement are returned.
    """
    found = case_of(lines)
    names = ", ".join(axis.name for axis in lines.axes)
    if found is not None:
        text = _with_names(found.title, lines)
        worst, parts = _worst(found, lines), tuple(found.requires(lines))
        return Requirement(text, worst.deviation, worst.is_length, parts=parts)
    kinds = _kinds(lines)
    missed = [(_worst(case, lines), case.title) for case in CASES if case.kinds == kinds]
    if not missed:
        return Requirement(f"the joints {names} have a known structure", np.inf)
    worst, title = min(missed, key=lambda each: each[0].deviation)
    text = _with_names(title, lines)
    return Requirement(text, worst.deviation, worst.is_length)


def _with_names(title: str, lines: Lines) -> str:
    return re.sub(r"\d", lambda number: lines.axes[int(number[0]) - 1].name, title)


def _kinds(lines: Lines) -> str:
    return "".join("r" if axis.turns else "p" for axis in lines.axes)


def _worst(case: Case, lines: Lines) -> Requirement:
    conditions = case.requires(lines)
    return max(conditions, key=lambda c: c.deviation, default=Requirement("", 0.0))


def _last_two_parallel(work: Work, lines: Lines, center: Vector, W: Vector) -> None:
    a1, a2, a3 = lines.axes
    # 1. Joints 2 and 3 do not move the center along their axes.
    reason = f"{a2.name} and {a3.name} do not move the center along their axes"
    sides = subtracted(work.terms, a3.p, a2.p), subtracted(work.terms, center, a3.p)
    U, _ = turn_to_plane(work, a1, a2, center, W, reason, sides)
    # 2, 3. Shoulder, elbow and wrist form a triangle normal to the parallel axes.
    triangle(work, a2, a3, center, U)


def _first_two_parallel(work: Work, lines: Lines, center: Vector, W: Vector) -> None:
    terms, (a1, a2, a3) = work.terms, lines.axes
    # 1. Joints 1 and 2 do not move the center along their axes.
    fore = subtracted(terms, center, a3.p)
    d = dot(terms, a1.h, subtracted(terms, W, a3.p))
    found = sp4(terms, a1.h, a3.h, fore, d, sign := work.sign())

    def in_reach() -> CosSin:
        sides = subtracted(terms, W, a1.p), subtracted(terms, a2.p, a1.p)
        distance2 = hypotenuse2(terms, a1.h, *sides)
        return by_cosine(terms, a3.h, subtracted(terms, a3.p, a2.p), fore, distance2, sign)

    q3 = work.step(
        [a3],
        "subproblem 4",
        f"{a1.name} and {a2.name} do not move the center along their axes",
        turn_in_reach(terms, (a1.h, a3.h), found, in_reach),
    )
    # 2, 3. Shoulder, elbow and wrist form a triangle normal to the parallel axes.
    reached = added(terms, a3.p, rotated(terms, a3.h, q3, fore))
    triangle(work, a1, a2, reached, subtracted(terms, W, a1.p))


def _first_two_meet(work: Work, lines: Lines, center: Vector, W: Vector) -> None:
    terms, (a1, a2, a3) = work.terms, lines.axes
    C = lines.meeting(0, 1)
    # 1. Joints 1 and 2 do not change the distance from the center to the intersection of their
    # axes.
    V = subtracted(terms, W, C)
    upper, fore = subtracted(terms, a3.p, C), subtracted(terms, center, a3.p)
    across2 = squared_across(terms, a3.h, V, (upper, fore))
    q3 = work.step(
        [a3],
        "subproblem 3",
        f"{a1.name} and {a2.name} do not change the distance from the center to the intersection "
        "of their axes",
        sp3(terms, a3.h, upper, fore, across2, work.sign(), dot(terms, V, V)),
    )
    # 2, 3. Both joints rotate the center about the intersection of their axes.
    _two_about_a_point(work, a1, a2, added(terms, upper, rotated(terms, a3.h, q3, fore)), V)


def _two_about_a_point(work: Work, a1: Axis, a2: Axis, p: Vector, v: Vector) -> None:
    """Solve ``R_1 R_2 p = v`` for the rotations R_1 and R_2 about two intersecting axes."""
    first, second = sp2(work.terms, a1.h, a2.h, p, v, work.sign())
    work.step(
        [a1],
        "subproblem 2",
        f"{a2.name} does not move the center along its axis",
        first,
        "if the center is on the axis, the angle is arbitrary and set to 0",
    )
    reason = f"this joint produces the remaining rotation after {a1.name}"
    work.step([a2], "subproblem 1", reason, second)


def _last_two_meet(work: Work, lines: Lines, center: Vector, W: Vector) -> None:
    terms, (a1, a2, a3) = work.terms, lines.axes
    C = lines.meeting(1, 2)
    # 1. Joints 2 and 3 do not change the distance from the center to the intersection of axes 2 and
    # 3. The distance |R_1^T V - c| from the target, rotated back by joint 1, to this intersection
    # is therefore known.
    V, c = subtracted(terms, W, a1.p), subtracted(terms, C, a1.p)
    reach = subtracted(terms, center, C)
    minus_h = negative(a1.h)
    minus_c = negative(c)
    across2 = squared_across(terms, minus_h, reach, (minus_c, V))
    q1 = work.step(
        [a1],
        "subproblem 3",
        f"{a2.name} and {a3.name} do not change the distance from the center to the intersection "
        "of their axes",
        sp3(terms, minus_h, minus_c, V, across2, work.sign(), dot(terms, reach, reach)),
        "if the center is on the first axis, the angle is arbitrary and set to 0",
    )
    # 2, 3. Both joints rotate the center about the intersection of their axes.
    _two_about_a_point(work, a2, a3, reach, subtracted(terms, rotated(terms, a1.h, q1.back, V), c))


def _any(work: Work, lines: Lines, center: Vector, W: Vector) -> None:
    terms, (a1, a2, a3) = work.terms, lines.axes
    # The equation is R_1^T (W - p_1) - (p_2 - p_1) = R_2 (p_3 - p_2 + R_3 (C - p_3)). Joint 2
    # changes neither the length of a vector nor its component along axis 2.
    turns = loop_of_three(
        work,
        (a1, a2, a3),
        "the loop of shoulder, elbow and center closes",
        (subtracted(terms, a1.p, a2.p), negative(a1.h), subtracted(terms, W, a1.p)),
        (a2.h, subtracted(terms, a3.p, a2.p)),
        (a3.h, subtracted(terms, center, a3.p)),
    )
    for axis, turn in zip((a1, a2, a3), turns, strict=True):
        work.turns[axis.joint] = turn


def _meeting_then_slide(work: Work, lines: Lines, center: Vector, W: Vector) -> None:
    terms, (a1, a2, a3) = work.terms, lines.axes
    C = lines.meeting(0, 1)
    # 1. Joints 1 and 2 do not change the distance from the center to the intersection of their
    # axes.
    V, reach = subtracted(terms, W, C), subtracted(terms, center, C)
    r2 = dot(terms, V, V)
    length = work.slide(
        a3,
        "line-sphere intersection",
        f"{a1.name} and {a2.name} do not change the distance from the center to the intersection "
        "of their axes",
        slide_to_sphere(terms, a3.h, reach, r2, work.sign()),
    )
    # 2, 3. Both joints rotate the center about the intersection of their axes.
    extended = combination(terms, (sp.Integer(1), length), (reach, a3.h))
    _two_about_a_point(work, a1, a2, extended, V)


def _parallel_then_slide(work: Work, lines: Lines, center: Vector, W: Vector) -> None:
    terms, (a1, a2, a3) = work.terms, lines.axes
    # 1. Only the prismatic joint moves the center along the parallel axes.
    found = slide_to_plane(terms, a1.h, a3.h, center, dot(terms, a1.h, W))

    def in_reach() -> sp.Expr:
        sides = subtracted(terms, W, a1.p), subtracted(terms, a2.p, a1.p)
        start, distance2 = subtracted(terms, center, a2.p), hypotenuse2(terms, a1.h, *sides)
        return slide_to_distance(terms, a1.h, a3.h, start, distance2)

    length = work.slide(
        a3,
        "line-plane intersection",
        f"{a1.name} and {a2.name} do not move the center along their axes",
        slide_in_reach(terms, found, in_reach),
    )
    # 2, 3. Shoulder, elbow and wrist form a triangle normal to the parallel axes.
    extended = combination(terms, (sp.Integer(1), length), (center, a3.h))
    triangle(work, a1, a2, extended, subtracted(terms, W, a1.p))


def _turn_across_slide(work: Work, lines: Lines, center: Vector, W: Vector) -> None:
    terms, (a1, a2, a3) = work.terms, lines.axes
    # 1. Joint 2 and the perpendicular prismatic joint do not move the center along axis 2.
    reason = f"{a2.name} and {a3.name} do not move the center along axis {a2.name}"
    levers = (W, a1.p), (a2.p, a1.p), (center, a2.p)
    sides = [subtracted(terms, *lever) for lever in levers]
    U, _ = turn_to_plane(work, a1, a2, center, W, reason, sides)
    # 2. Joint 2 does not change the distance from the center to axis 2.
    A = perpendicular(terms, a2.h, U)
    reach = perpendicular(terms, a2.h, subtracted(terms, center, a2.p))
    length = work.slide(
        a3,
        "line-sphere intersection",
        f"{a2.name} does not change the distance from the center to its axis",
        slide_to_sphere(terms, a3.h, reach, dot(terms, A, A), work.sign()),
    )
    # 3. Joint 2 rotates the extended arm to the target position of the center.
    extended = combination(terms, (sp.Integer(1), length), (reach, a3.h))
    work.step(
        [a2],
        "subproblem 1",
        "this joint rotates the center to its target position",
        sp1(terms, a2.h, extended, A),
    )


def _three_slides(work: Work, lines: Lines, center: Vector, W: Vector) -> None:
    slides(work, lines.axes, subtracted(work.terms, W, center), "the center")


def _slide_then_parallel(work: Work, lines: Lines, center: Vector, W: Vector) -> None:
    terms, (a1, a2, a3) = work.terms, lines.axes
    # 1. Only the prismatic joint moves the center along the parallel axes.
    found = slide_to_plane(terms, a2.h, a1.h, center, dot(terms, a2.h, W))

    def in_reach() -> sp.Expr:
        sides = subtracted(terms, a3.p, a2.p), subtracted(terms, center, a3.p)
        start, distance2 = subtracted(terms, W, a2.p), hypotenuse2(terms, a2.h, *sides)
        return slide_to_distance(terms, a2.h, negative(a1.h), start, distance2)

    length = work.slide(
        a1,
        "line-plane intersection",
        f"{a2.name} and {a3.name} do not move the center along their axes",
        slide_in_reach(terms, found, in_reach),
    )
    # 2, 3. Shoulder, elbow and wrist form a triangle normal to the parallel axes.
    A = combination(terms, (sp.Integer(1), sp.Integer(-1), -length), (W, a2.p, a1.h))
    triangle(work, a2, a3, center, A)


def _slide_then_meeting(work: Work, lines: Lines, center: Vector, W: Vector) -> None:
    terms, (a1, a2, a3) = work.terms, lines.axes
    C = lines.meeting(1, 2)
    # 1. Joints 2 and 3 do not change the distance from the center to the intersection of their
    # axes.
    reach, V = subtracted(terms, center, C), subtracted(terms, W, C)
    minus_h = negative(a1.h)
    length = work.slide(
        a1,
        "line-sphere intersection",
        f"{a2.name} and {a3.name} do not change the distance from the center to the intersection "
        "of their axes",
        slide_to_sphere(terms, minus_h, V, dot(terms, reach, reach), work.sign()),
    )
    # 2, 3. Both joints rotate the center about the intersection of their axes.
    left = combination(terms, (sp.Integer(1), length), (V, minus_h))
    _two_about_a_point(work, a2, a3, reach, left)


def _oblique(lines: Lines, i: int, j: int) -> Requirement:
    sideways = abs(float(lines.axes[i].direction @ lines.axes[j].direction)) < OBLIQUE_AXES
    text = f"{lines.axes[j].name} is not perpendicular to axis {lines.axes[i].name}"
    return Requirement(text, np.inf if sideways else 0.0)


def _turned_out(lines: Lines) -> Requirement:
    a, b, c = (axis.direction for axis in lines.axes)
    normal = np.cross(a, b)
    flat = np.linalg.norm(np.cross(normal, c)) < OBLIQUE_AXES
    text = f"{lines.axes[2].name} moves the point out of the plane of the prismatic joints"
    return Requirement(text, np.inf if flat else 0.0)


def _independent(lines: Lines) -> Requirement:
    volume = float(np.linalg.det([axis.direction for axis in lines.axes]))
    text = "the prismatic joints have independent directions"
    return Requirement(text, np.inf if abs(volume) < OBLIQUE_AXES else 0.0)


CASES = (
    Case("rrr", "axes 2 and 3 are parallel", 4, lambda a: [parallel(a, 1, 2)], _last_two_parallel),
    Case("rrr", "axes 1 and 2 are parallel", 4, lambda a: [parallel(a, 0, 1)], _first_two_parallel),
    Case("rrr", "axes 1 and 2 intersect", 4, lambda a: [meeting(a, 0, 1)], _first_two_meet),
    Case("rrr", "axes 2 and 3 intersect", 4, lambda a: [meeting(a, 1, 2)], _last_two_meet),
    Case("rrr", "joints 1, 2 and 3 are revolute", 4, lambda _: [], _any),
    Case(
        "rrp",
        "axes 1 and 2 intersect, and joint 3 is prismatic",
        4,
        lambda a: [meeting(a, 0, 1)],
        _meeting_then_slide,
    ),
    Case(
        "rrp",
        "axes 1 and 2 are parallel and not perpendicular to prismatic joint 3",
        2,
        lambda a: [parallel(a, 0, 1), _oblique(a, 0, 2)],
        _parallel_then_slide,
    ),
    Case(
        "rrp",
        "joint 3 is prismatic and perpendicular to axis 2",
        4,
        lambda a: [across(a, 1, 2)],
        _turn_across_slide,
    ),
    Case(
        "prr",
        "axes 2 and 3 are parallel and not perpendicular to prismatic joint 1",
        2,
        lambda a: [parallel(a, 1, 2), _oblique(a, 1, 0)],
        _slide_then_parallel,
    ),
    Case(
        "prr",
        "joint 1 is prismatic, and axes 2 and 3 intersect",
        4,
        lambda a: [meeting(a, 1, 2)],
        _slide_then_meeting,
    ),
    Case(
        "rpp",
        "joint 1 is revolute, and joints 2 and 3 are prismatic",
        2,
        lambda a: [rises(a)],
        turn_then_slides,
    ),
    Case(
        "prp",
        "joints 1 and 3 are prismatic, and joint 1 is parallel to axis 2",
        2,
        lambda a: [parallel(a, 0, 1), askew(a, 1, 2)],
        slide_turn_slide,
    ),
    Case(
        "prp",
        "joints 1 and 3 are prismatic, and joint 3 is parallel to axis 2",
        2,
        lambda a: [parallel(a, 1, 2), askew(a, 0, 1)],
        slide_turn_slide,
    ),
    Case(
        "prp",
        "joints 1 and 3 are prismatic, and joint 1 is perpendicular to axis 2",
        2,
        lambda a: [across(a, 0, 1), _oblique(a, 1, 2)],
        slide_turn_slide,
    ),
    Case(
        "prp",
        "joints 1 and 3 are prismatic, and joint 3 is perpendicular to axis 2",
        2,
        lambda a: [across(a, 1, 2), _oblique(a, 1, 0)],
        slide_turn_slide,
    ),
    Case(
        "rpr",
        "axes 1 and 3 are parallel and not perpendicular to prismatic joint 2",
        2,
        lambda a: [parallel(a, 0, 2), _oblique(a, 0, 1)],
        turn_slide_parallel_turn,
    ),
    Case(
        "rpr",
        "joint 2 is prismatic and perpendicular to axis 1",
        4,
        lambda a: [across(a, 0, 1), askew(a, 0, 2)],
        turn_slide_turn,
    ),
    Case(
        "ppr",
        "joints 1 and 2 are prismatic, and joint 3 is revolute",
        2,
        lambda a: [_turned_out(a)],
        slides_then_turn,
    ),
    Case("ppp", "joints 1, 2 and 3 are prismatic", 1, lambda a: [_independent(a)], _three_slides),
)
