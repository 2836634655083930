"""Three revolute and prismatic joints that position a point.

A rotation changes neither the component of a point along the rotation axis nor its distance from
this axis. Therefore, a plane or a sphere determines one prismatic joint, and the other joints
follow from this joint.
"""

import numpy as np
import sympy as sp

from ...model.tolerances import EXACT_STRUCTURE, OBLIQUE_AXES
from ...terms.vectors import Vector, added, combination, dot, subtracted
from ..structure.lines import Axis, Lines
from ..structure.requirement import Requirement
from ..subproblems.equations import LineAndSphere
from ..subproblems.found import FoundLength
from ..subproblems.slides import slide_to_plane, slide_to_sphere
from ..subproblems.sp1 import sp1
from ..subproblems.sp4 import sp4
from ..subproblems.turns import perpendicular, rotated
from .triangle import triangle
from .work import Work

_ONE = sp.Integer(1)


def rises(lines: Lines) -> Requirement:
    """Requires a prismatic joint along axis 1, and one more in an independent direction."""
    a1, a2, a3 = (axis.direction for axis in lines.axes)
    along = max(abs(float(a1 @ a2)), abs(float(a1 @ a3)))
    spread = float(np.linalg.norm(np.cross(a2, a3)))
    names = [axis.name for axis in lines.axes]
    text = f"{names[1]} or {names[2]} moves along axis {names[0]}, and both in a plane"
    return Requirement(text, np.inf if min(along, spread) < OBLIQUE_AXES else 0.0)


def turn_then_slides(work: Work, lines: Lines, center: Vector, W: Vector) -> None:
    """Solves ``exp(S_1 q_1) Trans(t_2 h_2 + t_3 h_3) C = W``; up to two solutions."""
    terms, (a1, a2, a3) = work.terms, lines.axes
    up = [abs(float(a1.direction @ axis.direction)) for axis in (a2, a3)]
    lift, other = (a2, a3) if up[0] > up[1] else (a3, a2)
    u, c = subtracted(terms, W, a1.p), subtracted(terms, center, a1.p)
    # 1. The lift joint compensates the height change of the other prismatic joint. The two
    # prismatic joints together move the point perpendicular to axis 1 at the target height.
    rate = dot(terms, a1.h, lift.h)
    ratio = terms.let(-dot(terms, a1.h, other.h) / rate)
    displacement = combination(terms, (_ONE, ratio), (other.h, lift.h))
    height = terms.let(dot(terms, a1.h, subtracted(terms, u, c)) / rate)
    length = _to_distance(
        work, other, a1, displacement, combination(terms, (_ONE, height), (c, lift.h)), u
    )
    # 2. The lift joint.
    reached = combination(terms, (_ONE, length), (c, other.h))
    extended = _to_height(work, lift, a1, reached, u)
    # 3. The revolute joint.
    _turn(work, a1, combination(terms, (_ONE, extended), (reached, lift.h)), u)


def slide_turn_slide(work: Work, lines: Lines, center: Vector, W: Vector) -> None:
    """Solves ``Trans(t_1 h_1) exp(S_2 q_2) Trans(t_3 h_3) C = W``; up to two solutions."""
    terms, (a1, a2, a3) = work.terms, lines.axes
    back = a1.reversed()
    u, c = subtracted(terms, W, a2.p), subtracted(terms, center, a2.p)
    conditions = [(a1, u, back, c), (a3, c, a3, u)]
    # The height of the target determines one prismatic joint, and the distance of the target from
    # the axis determines the other joint. The height determines the prismatic joint that does not
    # change the distance from the axis, or the only joint that changes the height.
    first_by_height = _is_along(a1, a2) or _is_across(a3, a2)
    (slide, own, sense, goal), (other, own2, sense2, goal2) = (
        conditions if first_by_height else conditions[::-1]
    )
    if _is_along(slide, a2):
        length = _to_distance(work, other, a2, sense2.h, own2, goal2)
        there = combination(terms, (_ONE, length), (own2, sense2.h))
        rise = _to_height(work, sense, a2, own, there)
        here = combination(terms, (_ONE, rise), (own, sense.h))
    else:
        rise = _to_height(work, sense, a2, own, goal)
        here = combination(terms, (_ONE, rise), (own, sense.h))
        length = _to_distance(work, other, a2, sense2.h, own2, here)
        there = combination(terms, (_ONE, length), (own2, sense2.h))
    before, after = (there, here) if slide is a1 else (here, there)
    _turn(work, a2, before, after)


def turn_slide_parallel_turn(work: Work, lines: Lines, center: Vector, W: Vector) -> None:
    """Solves for two parallel revolute joints with a prismatic joint between them."""
    terms, (a1, a2, a3) = work.terms, lines.axes
    length = _to_height(work, a2, a1, center, W)
    by = combination(terms, (length,), (a2.h,))
    moved = a3.moved(added(terms, a3.p, by), a3.origin)
    triangle(work, a1, moved, added(terms, center, by), subtracted(terms, W, a1.p))


def turn_slide_turn(work: Work, lines: Lines, center: Vector, W: Vector) -> None:
    """Solves for two revolute joints and a prismatic joint normal to axis 1; up to 4 solutions."""
    terms, (a1, a2, a3) = work.terms, lines.axes
    # 1. Neither joint 1 nor the prismatic joint moves the center along axis 1.
    reach = subtracted(terms, center, a3.p)
    q3 = work.step(
        [a3],
        "subproblem 4",
        f"{a1.name} and {a2.name} do not move the center along axis {a1.name}",
        sp4(
            terms,
            a1.h,
            a3.h,
            reach,
            dot(terms, a1.h, subtracted(terms, W, a3.p)),
            work.sign(),
        ),
    )
    # 2, 3. The distance of the point from axis 1 determines the prismatic joint; the revolute joint
    # follows.
    u = subtracted(terms, W, a1.p)
    carried = added(terms, subtracted(terms, a3.p, a1.p), rotated(terms, a3.h, q3, reach))
    length = _to_distance(work, a2, a1, a2.h, carried, u)
    _turn(work, a1, combination(terms, (_ONE, length), (carried, a2.h)), u)


def _is_along(slide: Axis, axis: Axis) -> bool:
    tilt = np.linalg.norm(np.cross(slide.direction, axis.direction))
    return float(tilt) <= EXACT_STRUCTURE


def _is_across(slide: Axis, axis: Axis) -> bool:
    return abs(float(slide.direction @ axis.direction)) <= EXACT_STRUCTURE


def _to_height(work: Work, slide: Axis, axis: Axis, point: Vector, goal: Vector) -> sp.Expr:
    """Solves for the prismatic joint that moves ``point`` to the height of ``goal``."""
    terms = work.terms
    return work.slide(
        slide,
        "line-plane intersection",
        f"{axis.name} does not move the center along its axis",
        slide_to_plane(terms, axis.h, slide.h, point, dot(terms, axis.h, goal)),
    )


def _to_distance(
    work: Work, slide: Axis, axis: Axis, displacement: Vector, point: Vector, goal: Vector
) -> sp.Expr:
    """Solves for the prismatic joint that moves ``point`` to the axis distance of ``goal``.

    Args:
        work: Records the step.
        slide: The prismatic joint.
        axis: The revolute axis.
        displacement: The displacement of the point per unit displacement of the prismatic joint.
        point: The position of the point relative to the axis.
        goal: The goal point, relative to the axis.
    """
    terms = work.terms
    across, offset, wanted = (perpendicular(terms, axis.h, v) for v in (displacement, point, goal))
    inverse = terms.let(1 / terms.let(sp.sqrt(dot(terms, across, across))))
    unit = combination(terms, (inverse,), (across,))
    found = slide_to_sphere(terms, unit, offset, dot(terms, wanted, wanted), work.sign())
    assert isinstance(found.equation, LineAndSphere)
    equation = LineAndSphere(
        terms.let(found.equation.linear * inverse),
        terms.let(found.equation.constant * terms.let(inverse**2)),
    )
    scaled = FoundLength(terms.let(found.length * inverse), equation, found.sign, found.margin)
    reason = f"{axis.name} keeps the center's distance from its axis"
    return work.slide(slide, "line-sphere intersection", reason, scaled)


def _turn(work: Work, axis: Axis, before: Vector, after: Vector) -> None:
    work.step(
        [axis],
        "subproblem 1",
        "the rest of the way to the position",
        sp1(work.terms, axis.h, before, after),
        "with the center on the axis the angle is arbitrary and taken as 0",
    )
