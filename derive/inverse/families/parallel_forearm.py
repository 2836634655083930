"""Six revolute joints. Axes 2, 3 and 4 are parallel.

Joints 2 to 4 do not change vector components along axes 2 to 4. Therefore, axis 6 satisfies two
equations that do not contain angles 2 to 4. One equation contains the component of the direction of
axis 6 along axes 2 to 4. The other equation contains the component of the position of a point on
axis 6 along axes 2 to 4. Subproblem 6 solves the two equations for angles 1 and 5. Maximum number
of solutions: 8.

Source: Elias and Wen 2022, 4.1 (2, 3, 4 parallel).
"""

from collections.abc import Sequence

import sympy as sp
from sympy.logic.boolalg import Boolean

from ...model.tolerances import (
    NEARLY_REAL,
    PARABOLA_STEP,
    SOLUTION_SEPARATION,
    UNDETERMINED_TURN,
)
from ...terms.terms import Terms
from ...terms.vectors import Vector, added, combination, cross, dot, subtracted
from ..steps.elbow_in_reach import with_elbow_in_reach
from ..steps.loop_of_three import negative
from ..steps.rotations import last_turn
from ..steps.target import Target
from ..steps.triangle import remaining, triangle
from ..steps.work import Work
from ..structure.lines import Lines
from ..structure.requirement import Requirement, askew, parallel, revolute
from ..subproblems.equations import TwoEllipses
from ..subproblems.found import FoundTurn
from ..subproblems.quartic import select
from ..subproblems.second_order import Expansion, step_on_parabola
from ..subproblems.sp1 import sp1
from ..subproblems.sp6 import advanced, algebraic, chosen
from ..subproblems.turns import CosSin, any_across, perpendicular, rotated
from .family import Family

STEPS = 2
"""Number of second-order refinement steps per root of the quartic."""


def _requires(lines: Lines) -> list[Requirement]:
    return [
        revolute(lines, range(6)),
        parallel(lines, 1, 2, 3),
        askew(lines, 0, 1),
        askew(lines, 4, 1),
    ]


def _solve(work: Work, lines: Lines, target: Target) -> None:
    terms = work.terms
    a1, a2, a3, a4, a5, a6 = lines.axes
    h = a2.h

    # 1, 2. Joints 2 to 4 do not change vector components along h_2, the direction of their axes.
    W = subtracted(terms, target.point(terms, a6.p), a1.p)
    v = target.turned(terms, a6.h)
    reach = subtracted(terms, a6.p, a5.p)
    constant = dot(terms, h, subtracted(terms, a5.p, a1.p))
    rows = [
        _row(terms, h, (negative(a1.h), W), (a5.h, reach), constant),
        _row(terms, h, (negative(a1.h), v), (a5.h, a6.h), sp.Integer(0)),
    ]
    signs = work.sign(), work.sign()
    (A1, B1, b1), (A2, B2, b2) = rows
    found = algebraic(terms, (A1, A2), (B1, B2), (b1, b2), signs, SOLUTION_SEPARATION)
    equation = TwoEllipses((A1, A2), (B1, B2), (b1, b2))
    q1, q5 = found.first, found.second
    exists = found.margin >= -NEARLY_REAL
    for _ in range(STEPS):
        q1, q5 = _nearer(terms, lines, v, rows, (q1, q5), exists)
    q1, q5 = _aligned(terms, lines, v, rows[0], (q1, q5))
    for axis, turn in ((a1, q1), (a5, q5)):
        work.step(
            [axis],
            "subproblem 6",
            "joints 2 to 4 do not change the components of axis 6 and of a point of axis 6 along "
            "axes 2 to 4",
            FoundTurn(turn, equation, signs[0], found.margin),
        )

    # 3. Joints 2 to 4 rotate axis 6 by the sum of their angles.
    U = added(terms, rotated(terms, a1.h, q1.back, W), subtracted(terms, a1.p, a2.p))
    seen = rotated(terms, a1.h, q1.back, v)
    carried = rotated(terms, a5.h, q5, a6.h)
    hand = added(terms, a5.p, rotated(terms, a5.h, q5, reach))
    found_sum = with_elbow_in_reach(
        work, lines, sp1(terms, h, carried, seen), seen, U, hand, signs[1]
    )
    q234 = work.step(
        [a2, a3, a4],
        "subproblem 1",
        "joints 2 to 4 rotate axis 6 together",
        found_sum,
        "if axis 6 is parallel to axes 2 to 4, the sum is arbitrary; it is set to the value at "
        "which the elbow is nearest to a right angle",
    )

    # 4. The remaining rotation.
    e = any_across(terms, a6.h)
    before = (a1, q1), (a2, q234), (a5, q5)
    wanted = target.turned(terms, e)
    last_turn(work, a6, e, wanted, before, behind=" after joints 1 to 5", is_regular=True)

    # 5. Shoulder, elbow and wrist form a triangle in the plane normal to the parallel axes.
    lever = rotated(terms, h, q234, subtracted(terms, hand, a4.p))
    triangle(work, a2, a3, a4.p, subtracted(terms, U, lever))
    remaining(work, (a2, a3, a4), q234)


Row = tuple[tuple[sp.Expr, sp.Expr], tuple[sp.Expr, sp.Expr], sp.Expr]
"""Equation in angles 1 and 5, with the (sin, cos) coefficients of each angle and the right-hand
side."""


def _nearer(
    terms: Terms,
    lines: Lines,
    v: Vector,
    rows: Sequence[Row],
    angles: tuple[CosSin, CosSin],
    exists: Boolean,
) -> tuple[CosSin, CosSin]:
    """Return angles 1 and 5 after a second-order refinement step.

    Angles 1 and 5 are unchanged unless the refinement reduces the sum of the squared errors of both
    equations.

    If axis 6 is nearly parallel to axes 2 to 4, the component of its direction along these axes
    determines this direction only to 1e-8. The component normal to axes 2 to 4 is accurate to
    double precision. Let c and c' be the components of two unit vectors along axes 2 to 4. Let p
    and p' be the projections of the same two unit vectors onto the plane normal to axes 2 to 4. The
    components and projections of these unit vectors satisfy ``|p|^2 - |p'|^2 = (c' - c)(c' + c)``.
    """
    let, h = terms.let, lines.axes[1].h
    a1, a5, a6 = lines.axes[0], lines.axes[4], lines.axes[5]

    def errors(q1: CosSin, q5: CosSin) -> tuple[sp.Expr, sp.Expr]:
        (A, B, b), _ = rows
        first = let(A[0] * q1.s + A[1] * q1.c + B[0] * q5.s + B[1] * q5.c - b)
        seen, carried = rotated(terms, a1.h, q1.back, v), rotated(terms, a5.h, q5, a6.h)
        c, c_carried = dot(terms, h, seen), dot(terms, h, carried)
        across, across_carried = (perpendicular(terms, h, u) for u in (seen, carried))
        total = let(c + c_carried)
        square = let(dot(terms, across_carried, across_carried) - dot(terms, across, across))
        near = sp.Abs(total) > 1
        second = select(
            terms, near, let(square / select(terms, near, total, sp.Integer(1))), let(c - c_carried)
        )
        return first, second

    q1, q5 = angles
    here = errors(q1, q5)
    one, two = (
        Expansion(
            error,
            let(A[0] * q1.c - A[1] * q1.s),
            let(B[0] * q5.c - B[1] * q5.s),
            let(-A[0] * q1.s - A[1] * q1.c),
            let(-B[0] * q5.s - B[1] * q5.c),
        )
        for error, (A, B, _) in zip(here, rows, strict=True)
    )
    step1, step5 = step_on_parabola(terms, (one, two))
    there = advanced(terms, q1, step1), advanced(terms, q5, step5)
    left = errors(*there)
    better = sp.And(exists, let(left[0] ** 2 + left[1] ** 2) < let(here[0] ** 2 + here[1] ** 2))
    return chosen(terms, better, there[0], q1), chosen(terms, better, there[1], q5)


def _aligned(
    terms: Terms, lines: Lines, v: Vector, row: Row, angles: tuple[CosSin, CosSin]
) -> tuple[CosSin, CosSin]:
    """Return angles 1 and 5 at which axis 6 is parallel to axes 2 to 4.

    If no angles near ``angles`` make axis 6 parallel to axes 2 to 4, ``angles`` is returned
    unchanged. At a pose where axis 6 is parallel to axes 2 to 4, several solutions coincide, so
    their accuracy is only 1e-5.
    """
    let, h = terms.let, lines.axes[1].h
    a1, a5, a6 = lines.axes[0], lines.axes[4], lines.axes[5]
    q1, q5 = angles
    carried = rotated(terms, a5.h, q5, a6.h)
    side = select(terms, dot(terms, h, carried) >= 0, sp.Integer(1), sp.Integer(-1))
    along = combination(terms, (side,), (h,))
    p1, p5 = sp1(terms, a1.h, along, v).turn, sp1(terms, a5.h, a6.h, along).turn
    A, B, b = row
    gap = let(A[0] * p1.s + A[1] * p1.c + B[0] * p5.s + B[1] * p5.c - b)
    offsets = [
        perpendicular(terms, h, u)
        for u in (rotated(terms, a1.h, p1.back, v), rotated(terms, a5.h, p5, a6.h))
    ]
    off = let(sum((dot(terms, u, u) for u in offsets), let(gap**2)))
    moved = let(
        let(p1.c - q1.c) ** 2
        + let(p1.s - q1.s) ** 2
        + let(p5.c - q5.c) ** 2
        + let(p5.s - q5.s) ** 2
    )
    solves = sp.And(off <= let(UNDETERMINED_TURN**2), moved <= let(PARABOLA_STEP**2))
    return chosen(terms, solves, p1, q1), chosen(terms, solves, p5, q5)


def _row(
    terms: Terms,
    h: Vector,
    left: tuple[Vector, Vector],
    right: tuple[Vector, Vector],
    constant: sp.Expr,
) -> Row:
    """Return the coefficients and right-hand side of ``h.R(k1) p1 = c + h.R(k2) p2``."""
    (k1, p1), (k2, p2) = left, right
    along = [terms.let(dot(terms, h, k) * dot(terms, k, p)) for k, p in (left, right)]
    A = dot(terms, h, cross(terms, k1, p1)), dot(terms, h, perpendicular(terms, k1, p1))
    B = dot(terms, h, cross(terms, k2, p2)), dot(terms, h, perpendicular(terms, k2, p2))
    return A, (-B[0], -B[1]), terms.let(constant + along[1] - along[0])


PARALLEL_FOREARM = Family("three parallel axes 2, 3, 4", (6,), _requires, _solve)
