"""Solves for three joints, revolute or prismatic, that position a point.

A rotation about an axis changes neither the height of a point along the axis nor the distance of
the point from the axis. A prismatic joint moves a point along a line. Therefore, the intersection
of this line with a plane or a sphere determines the displacement of one prismatic joint. The
remaining equations then determine the other joints.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import sympy as sp

from ...model.tolerances import EXACT_STRUCTURE, OBLIQUE_AXES, UNDETERMINED_SUM
from ...terms.terms import Terms
from ...terms.vectors import Vector, added, combination, cross, dot, subtracted
from ..structure.lines import Axis, Lines
from ..structure.requirement import Requirement
from ..subproblems.equations import LineAndSphere
from ..subproblems.found import FoundLength, FoundTurn
from ..subproblems.quartic import select
from ..subproblems.slides import slide_to_plane, slide_to_sphere
from ..subproblems.sp1 import sp1
from ..subproblems.sp4 import sp4
from ..subproblems.sp6 import chosen
from ..subproblems.turns import CosSin, perpendicular, rotated
from .dependent_slides import DEPENDENT_SLIDES, common_normal, normal_to_both, squared_sine
from .position_in_reach import hypotenuse2, slide_in_reach, slide_to_distance, turn_in_reach
from .slides import two_slides
from .triangle import triangle
from .work import Work

_ONE = sp.Integer(1)


def rises(lines: Lines) -> Requirement:
    """Require two prismatic joints in different directions, at least one not normal to axis 1."""
    a1, a2, a3 = (axis.direction for axis in lines.axes)
    along = max(abs(float(a1 @ a2)), abs(float(a1 @ a3)))
    spread = float(np.linalg.norm(np.cross(a2, a3)))
    names = [axis.name for axis in lines.axes]
    text = (
        f"{names[1]} or {names[2]} moves the point along axis {names[0]}, and their directions "
        "differ"
    )
    return Requirement(text, np.inf if min(along, spread) < OBLIQUE_AXES else 0.0)


def turn_then_slides(work: Work, lines: Lines, center: Vector, W: Vector) -> None:
    """Solve for a revolute joint followed by two prismatic joints, with up to two solutions.

    The joint values satisfy ``exp(S_1 q_1) Trans(t_2 h_2 + t_3 h_3) C = W`` for a point C and its
    target W.
    """
    terms, (a1, a2, a3) = work.terms, lines.axes
    up = [abs(float(a1.direction @ axis.direction)) for axis in (a2, a3)]
    lift, other = (a2, a3) if up[0] > up[1] else (a3, a2)
    u, c = subtracted(terms, W, a1.p), subtracted(terms, center, a1.p)
    # 1. The displacement of the prismatic joint `lift` cancels the height change that the prismatic
    # joint `other` causes. Together, the two prismatic joints keep the point at the target height
    # along axis 1.
    sign = work.sign()
    length, height = _two_lengths(terms, a1, (lift.h, other.h), (c, u), sign)
    rate, other_rate = (dot(terms, a1.h, slide.h) for slide in (lift, other))
    if not terms.is_constant(rate) and other_rate != 0:
        # For some values of the fixed joints, the joint `lift` does not move the point along axis
        # 1, but the joint `other` does.
        swapped = _two_lengths(terms, a1, (other.h, lift.h), (c, u), sign)
        is_steeper = terms.let(rate**2) >= terms.let(other_rate**2)
        length, height = (
            replace(one, length=select(terms, is_steeper, one.length, two.length))
            for one, two in zip((length, height), swapped[::-1], strict=True)
        )
    work.slide(other, "line-sphere intersection", _keeps_distance(a1), length)
    # 2. The lift joint.
    work.slide(lift, "line-plane intersection", _keeps_height(a1), height)
    # 3. The revolute joint.
    reached = combination(terms, (_ONE, length.length), (c, other.h))
    _turn(work, a1, combination(terms, (_ONE, height.length), (reached, lift.h)), u)


def _two_lengths(
    terms: Terms,
    axis: Axis,
    slides: tuple[Vector, Vector],
    points: tuple[Vector, Vector],
    sign: sp.Expr,
) -> tuple[FoundLength, FoundLength]:
    """Return the displacements of the prismatic joints ``other`` and ``lift``, in this order.

    Args:
        terms: Table of named terms.
        axis: The axis of the revolute joint that precedes the two prismatic joints.
        slides: The directions of the prismatic joints ``lift`` and ``other``.
        points: The position of a point in the home pose and its target position, relative to the
            revolute axis.
        sign: Selects one of two solutions.
    """
    (lift, other), (start, goal) = slides, points
    rate = dot(terms, axis.h, lift)
    ratio = terms.let(-dot(terms, axis.h, other) / rate)
    height = terms.let(dot(terms, axis.h, subtracted(terms, goal, start)) / rate)
    is_flat = sp.false
    if not terms.is_constant(rate):
        # If both prismatic joints are perpendicular to the revolute axis, ``lift`` first moves the
        # point onto a line parallel to ``other`` that intersects the axis. Then the joint ``other``
        # can move the point to any distance from the axis.
        is_flat = terms.let(rate**2) <= terms.let(UNDETERMINED_SUM**2)
        to_axis = _to_axis(terms, cross(terms, axis.h, other), lift, start)
        ratio = select(terms, is_flat, sp.S.Zero, ratio)
        height = select(terms, is_flat, to_axis, height)
    displacement = combination(terms, (_ONE, ratio), (other, lift))
    raised = combination(terms, (_ONE, height), (start, lift))
    length = _length_to_distance(terms, axis, displacement, raised, goal, sign)
    reached = combination(terms, (_ONE, length.length), (start, other))
    rise = slide_to_plane(terms, axis.h, lift, reached, dot(terms, axis.h, goal))
    return length, replace(rise, length=select(terms, is_flat, height, rise.length))


def _to_axis(terms: Terms, normal: Vector, slide: Vector, start: Vector) -> sp.Expr:
    """Return the prismatic joint displacement that moves a point into a plane through an axis.

    If the prismatic joint is parallel to the plane, the displacement is 0.
    """
    rate = dot(terms, normal, slide)
    size2 = terms.let(rate**2 + UNDETERMINED_SUM**2)
    return terms.let(-rate * dot(terms, normal, start) / size2)


def slides_then_turn(work: Work, lines: Lines, center: Vector, W: Vector) -> None:
    """Solve for two prismatic joints followed by a revolute joint, with up to two solutions.

    The joint values satisfy ``Trans(t_1 h_1 + t_2 h_2) exp(S_3 q_3) C = W`` for a point C and its
    target W.
    """
    terms, (a1, a2, a3) = work.terms, lines.axes
    # 1. Only the revolute joint moves the center in the direction perpendicular to both prismatic
    # axes.
    reach, V = subtracted(terms, center, a3.p), subtracted(terms, W, a3.p)
    q3 = work.step(
        [a3],
        "subproblem 4",
        f"{a1.name} and {a2.name} move the center in a plane",
        _turn_to_plane_of_slides(terms, (a1, a2, a3), reach, V, work.sign()),
    )
    # 2, 3. Two prismatic joints move the center in the plane of their directions.
    reached = added(terms, a3.p, rotated(terms, a3.h, q3, reach))
    two_slides(work, a1, a2, subtracted(terms, W, reached))


def _turn_to_plane_of_slides(
    terms: Terms, axes: tuple[Axis, ...], reach: Vector, goal: Vector, sign: sp.Expr
) -> FoundTurn:
    """Return the revolute joint's rotation after which two prismatic joints can reach the goal.

    Args:
        terms: Table of named terms.
        axes: The two prismatic joints, then the revolute joint.
        reach: The point in the home pose, relative to the revolute axis.
        goal: The goal point, relative to the revolute axis.
        sign: Selects one of two solutions.
    """
    h1, h2, h3 = (axis.h for axis in axes)
    normal = normal_to_both(terms, h1, h2)
    if all(map(terms.is_constant, normal)):
        return sp4(terms, normal, h3, reach, dot(terms, normal, goal), sign)
    # If the prismatic joints are parallel, they move the point along a line. The angle of the
    # revolute joint then follows from the plane that contains the line and is parallel to the
    # revolute axis. If the line is parallel to the revolute axis, the angle of the revolute joint
    # follows from the goal position.
    are_parallel = squared_sine(terms, h1, h2) <= terms.let(DEPENDENT_SLIDES**2)
    steep, flat = common_normal(terms, h1, h2), cross(terms, h1, h3)
    x, y, z = (select(terms, are_parallel, *each) for each in zip(flat, steep, strict=True))
    found = sp4(terms, (x, y, z), h3, reach, dot(terms, (x, y, z), goal), sign)
    are_all_parallel = sp.And(
        are_parallel, squared_sine(terms, h1, h3) <= terms.let(UNDETERMINED_SUM**2)
    )
    turn = chosen(terms, are_all_parallel, sp1(terms, h3, reach, goal).turn, found.turn)
    margin = found.margin and select(terms, are_all_parallel, sp.S.Zero, found.margin)
    return replace(found, turn=turn, margin=margin)


def slide_turn_slide(work: Work, lines: Lines, center: Vector, W: Vector) -> None:
    """Solve for a revolute joint between two prismatic joints, with up to two solutions.

    The joint values satisfy ``Trans(t_1 h_1) exp(S_2 q_2) Trans(t_3 h_3) C = W`` for a point C and
    its target W.
    """
    terms, (a1, a2, a3) = work.terms, lines.axes
    back = a1.reversed()
    u, c = subtracted(terms, W, a2.p), subtracted(terms, center, a2.p)
    conditions = [(a1, u, back, c), (a3, c, a3, u)]
    # The height of the target along axis 2 determines the displacement of one prismatic joint.
    # Either this prismatic joint is parallel to axis 2, or the other prismatic joint is
    # perpendicular to axis 2. The distance of the target from axis 2 determines the displacement of
    # the other prismatic joint.
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
        rise = _to_height(
            work,
            sense,
            a2,
            own,
            goal,
            lambda: slide_to_distance(terms, a2.h, sense.h, own, hypotenuse2(terms, a2.h, own2)),
        )
        here = combination(terms, (_ONE, rise), (own, sense.h))
        length = _to_distance(work, other, a2, sense2.h, own2, here)
        there = combination(terms, (_ONE, length), (own2, sense2.h))
    before, after = (there, here) if slide is a1 else (here, there)
    _turn(work, a2, before, after)


def turn_slide_parallel_turn(work: Work, lines: Lines, center: Vector, W: Vector) -> None:
    """Solve for two parallel revolute joints with a prismatic joint between them."""
    terms, (a1, a2, a3) = work.terms, lines.axes
    length = _to_height(work, a2, a1, center, W)
    by = combination(terms, (length,), (a2.h,))
    moved = a3.moved(added(terms, a3.p, by), a3.origin)
    triangle(work, a1, moved, added(terms, center, by), subtracted(terms, W, a1.p))


def turn_slide_turn(work: Work, lines: Lines, center: Vector, W: Vector) -> None:
    """Solve for revolute joints 1 and 3 and prismatic joint 2, which is normal to axis 1.

    The three joints have up to four solutions.
    """
    terms, (a1, a2, a3) = work.terms, lines.axes
    # 1. Joint 1 and the prismatic joint do not move the center along axis 1.
    reach = subtracted(terms, center, a3.p)
    d = dot(terms, a1.h, subtracted(terms, W, a3.p))
    found = sp4(terms, a1.h, a3.h, reach, d, sign := work.sign())

    def in_reach() -> CosSin:
        # At the returned angle of joint 3, the line along which the prismatic joint moves the
        # center is as near to axis 1 as possible.
        normal = cross(terms, a1.h, a2.h)
        nearest = dot(terms, normal, subtracted(terms, a1.p, a3.p))
        return sp4(terms, normal, a3.h, reach, nearest, sign).turn

    q3 = work.step(
        [a3],
        "subproblem 4",
        f"{a1.name} and {a2.name} do not move the center along axis {a1.name}",
        turn_in_reach(terms, (a1.h, a3.h), found, in_reach),
    )
    # 2, 3. The distance of the center from axis 1 determines the displacement of the prismatic
    # joint.
    u = subtracted(terms, W, a1.p)
    carried = added(terms, subtracted(terms, a3.p, a1.p), rotated(terms, a3.h, q3, reach))
    length = _to_distance(work, a2, a1, a2.h, carried, u)
    _turn(work, a1, combination(terms, (_ONE, length), (carried, a2.h)), u)


def _is_along(slide: Axis, axis: Axis) -> bool:
    tilt = np.linalg.norm(np.cross(slide.direction, axis.direction))
    return float(tilt) <= EXACT_STRUCTURE


def _is_across(slide: Axis, axis: Axis) -> bool:
    return abs(float(slide.direction @ axis.direction)) <= EXACT_STRUCTURE


def _to_height(
    work: Work,
    slide: Axis,
    axis: Axis,
    point: Vector,
    goal: Vector,
    in_reach: Callable[[], sp.Expr] | None = None,
) -> sp.Expr:
    """Solve for the prismatic displacement that moves ``point`` to the height of ``goal``.

    Args:
        work: Records the step.
        slide: The prismatic joint.
        axis: The revolute axis, along which the height is measured.
        point: Position of the moved point relative to the revolute axis, before the prismatic joint
            moves.
        goal: The goal point.
        in_reach: Function that returns the displacement to use if the prismatic joint does not
            change the height.
    """
    terms = work.terms
    found = slide_to_plane(terms, axis.h, slide.h, point, dot(terms, axis.h, goal))
    found = slide_in_reach(terms, found, in_reach) if in_reach else found
    return work.slide(slide, "line-plane intersection", _keeps_height(axis), found)


def _to_distance(
    work: Work, slide: Axis, axis: Axis, displacement: Vector, point: Vector, goal: Vector
) -> sp.Expr:
    """Solve for the displacement at which ``point`` and ``goal`` are equally far from the axis.

    Args:
        work: Records the step.
        slide: The prismatic joint.
        axis: The revolute axis.
        displacement: The velocity of the point per unit velocity of the prismatic joint.
        point: The position of the point relative to the axis.
        goal: The goal point, relative to the axis.
    """
    found = _length_to_distance(work.terms, axis, displacement, point, goal, work.sign())
    return work.slide(slide, "line-sphere intersection", _keeps_distance(axis), found)


def _length_to_distance(
    terms: Terms, axis: Axis, displacement: Vector, point: Vector, goal: Vector, sign: sp.Expr
) -> FoundLength:
    across, offset, wanted = (perpendicular(terms, axis.h, v) for v in (displacement, point, goal))
    square = dot(terms, across, across)
    inverse = terms.let(1 / terms.let(sp.sqrt(square)))
    unit = combination(terms, (inverse,), (across,))
    found = slide_to_sphere(terms, unit, offset, dot(terms, wanted, wanted), sign)
    assert isinstance(found.equation, LineAndSphere)
    equation = LineAndSphere(
        terms.let(found.equation.linear * inverse),
        terms.let(found.equation.constant * terms.let(inverse**2)),
    )
    length = terms.let(found.length * inverse)
    if not terms.is_constant(square):
        # A displacement along the axis does not change the distance of the point from the axis.
        is_along = square <= terms.let(UNDETERMINED_SUM**2)
        length = select(terms, is_along, sp.S.Zero, length)
    return FoundLength(length, equation, found.sign, found.margin)


def _keeps_height(axis: Axis) -> str:
    return f"{axis.name} does not move the center along its axis"


def _keeps_distance(axis: Axis) -> str:
    return f"{axis.name} does not change the distance from the center to its axis"


def _turn(work: Work, axis: Axis, before: Vector, after: Vector) -> None:
    work.step(
        [axis],
        "subproblem 1",
        "this joint rotates the center to its target position",
        sp1(work.terms, axis.h, before, after),
        "if the center is on the axis, the angle is arbitrary and set to 0",
    )
