"""Solution steps for an arm that moves in a plane on a rotating base.

After the rotating base, the arm has three parallel axes, or two parallel axes and a prismatic joint
perpendicular to them. The base and these three joints position the tool and set its pitch in the
arm plane. An optional fifth joint rotates the tool about an axis in the arm plane.
"""

from collections.abc import Sequence

import sympy as sp

from ...terms.vectors import Vector, added, cross, dot, subtracted
from ..structure.lines import Axis, Lines
from ..subproblems.found import FoundTurn
from ..subproblems.sp1 import sp1
from ..subproblems.sp3 import by_cosine
from ..subproblems.sp4 import sp4
from ..subproblems.turns import NO_TURN, CosSin, perpendicular, rotated
from ..subproblems.two_lines import EQUATIONS, component, of_two_lines
from .parallel_slides import telescope
from .position_in_reach import hypotenuse2, turn_in_reach
from .rotations import last_turn
from .target import Target
from .triangle import remaining, triangle
from .work import Work

ARM = 4
"""Number of joints before the optional fifth joint: the rotating base and three joints that move in
a plane."""
DIGITS = 20
"""Number of digits to which the arm length is rounded. The arm length is used only as a scale."""


def turn_to_plane(
    work: Work,
    first: Axis,
    second: Axis,
    carried: Vector,
    position: Vector,
    reason: str,
    sides: Sequence[Vector] = (),
) -> tuple[Vector, CosSin]:
    """Solve for joint 1 from a point's coordinate along the second axis.

    Args:
        work: Records the step.
        first: The axis of joint 1.
        second: The second axis.
        carried: The point in the home pose.
        position: The target position of the point.
        reason: The reason why no other joint moves the point along the second axis.
        sides: Vectors along the links. If the first and the second axis are parallel, the angle of
            joint 1 is selected so that the links in `sides` reach the target.

    Returns:
        Two values: the target position relative to the second axis, rotated back by joint 1, and
        the rotation by joint 1.
    """
    terms = work.terms
    V = subtracted(terms, position, first.p)
    d = dot(terms, second.h, subtracted(terms, carried, first.p))
    found = sp4(terms, V, first.h, second.h, d, sign := work.sign())

    def in_reach() -> CosSin:
        distance2 = hypotenuse2(terms, second.h, *sides)
        offset = subtracted(terms, first.p, second.p)
        return by_cosine(terms, first.reversed().h, offset, V, distance2, sign)

    turn = work.step(
        [first],
        "subproblem 4",
        reason,
        turn_in_reach(terms, (second.h, first.h), found, in_reach) if sides else found,
        "if the point is on the first axis, the angle is arbitrary and set to 0",
    )
    return seen_behind(work, first, second, V, turn), turn


def turn_to_direction(
    work: Work,
    lines: Lines,
    second: Axis,
    point: tuple[Vector, Vector],
    direction: tuple[Vector, Vector],
) -> tuple[Vector, CosSin]:
    """Solve for joint 1 from the target position of a tool point and a target tool direction.

    The later joints are revolute with parallel axes, or prismatic and perpendicular to these axes.
    Therefore, the later joints do not change the angle between the tool direction and the parallel
    axes.

    Args:
        work: Records the step.
        lines: The chain that starts with joint 1.
        second: The first of the parallel axes.
        point: The position of the tool point in the home pose, and its target position.
        direction: The tool direction in the home pose, and its target direction (unit vectors).

    Returns:
        Like ``turn_to_plane``.
    """
    terms, first = work.terms, lines.axes[0]
    (carried, wanted), (before, after) = point, direction
    V = subtracted(terms, wanted, first.p)
    height = dot(terms, second.h, subtracted(terms, carried, first.p))
    k = first.reversed().h
    # If the target is near the axis of joint 1, the relative position V is a small difference of
    # two large positions.
    size2 = terms.let(dot(terms, V, V) + sp.Float(lines.length**2, DIGITS))
    turn = work.step(
        [first],
        EQUATIONS,
        f"the other joints change neither the height of the point along axis {second.name} nor the "
        "angle between the tool direction and this axis",
        of_two_lines(
            terms,
            component(terms, second.h, k, V, height, size2),
            component(terms, second.h, k, after, dot(terms, second.h, before)),
            work.sign(),
        ),
    )
    return seen_behind(work, first, second, V, turn), turn


def seen_behind(work: Work, first: Axis, second: Axis, V: Vector, turn: CosSin) -> Vector:
    """Return a position relative to axis 2, in axes that rotate with joint 1."""
    terms = work.terms
    seen = rotated(terms, first.h, turn.back, V)
    return added(terms, seen, subtracted(terms, first.p, second.p))


def in_plane(lines: Lines) -> tuple[Axis, ...]:
    """Return the parallel revolute axes of the arm, which are normal to the arm plane."""
    return tuple(axis for axis in lines.axes[1:ARM] if axis.turns)


def arm_in_plane(work: Work, lines: Lines, target: Target) -> None:
    """Solve for all joints of a planar arm on a rotating base from a tool pose.

    Args:
        work: Records the steps.
        lines: The arm's joint axes: a rotating base, three joints that move in a plane, and an
            optional fifth joint.
        target: The pose that the chain must reach.
    """
    terms = work.terms
    a1, a2 = lines.axes[0], in_plane(lines)[0]
    fifth = lines.axes[ARM:]
    # 1. The parallel joints move the arm in a plane.
    carried = fifth[0].p if fifth else target.home
    meaning = f"a point of axis {fifth[0].name}" if fifth else "the tool's origin"
    wanted = work.name_vector(("W", "V"), meaning, target.point(terms, carried))
    e = fifth[0].h if fifth else _across(lines)
    if fifth:
        after = target.turned(terms, e)
        U, q1 = turn_to_direction(work, lines, a2, (carried, wanted), (e, after))
    else:
        U, q1 = _turned_with(work, lines, wanted, target)
    # 2. The parallel joints rotate the tool direction e. If the arm has a fifth joint, e is the
    # axis of the fifth joint.
    v = rotated(terms, a1.h, q1.back, target.turned(terms, e))
    total = turned_as_one(
        work,
        lines,
        sp1(terms, a2.h, e, v),
        "the sum of these angles rotates the tool in the arm plane",
    )
    # 3. A triangle.
    reach(work, lines, carried, U, total)
    # 4. The remaining rotation.
    for axis in fifth:
        e = cross(terms, axis.h, a2.h)
        last_turn(work, axis, e, target.turned(terms, e), ((a1, q1), (a2, total)))


def _turned_with(work: Work, lines: Lines, wanted: Vector, target: Target) -> tuple[Vector, CosSin]:
    terms, a1, a2 = work.terms, lines.axes[0], in_plane(lines)[0]
    q1 = work.step(
        [a1],
        "subproblem 1",
        f"the other joints do not rotate axis {a2.name}",
        sp1(terms, a1.h, a2.h, target.turned(terms, a2.h)),
    )
    return seen_behind(work, a1, a2, subtracted(terms, wanted, a1.p), q1), q1


def turned_to_plane(
    work: Work, lines: Lines, carried: Vector, position: Vector
) -> tuple[Vector, CosSin]:
    """Solve for joint 1, which rotates the arm plane so that the plane contains a position.

    The first returned value is the target position relative to the first parallel axis, in axes
    that rotate with joint 1. The second returned value is the rotation of joint 1.
    """
    a1, a2 = lines.axes[0], in_plane(lines)[0]
    reason = "the other joints move the point in the plane of the arm"
    return turn_to_plane(work, a1, a2, carried, position, reason)


def turned_as_one(work: Work, lines: Lines, found: FoundTurn, reason: str) -> CosSin:
    """Record the solution step for the angle sum of the parallel joints."""
    return work.step(in_plane(lines), "subproblem 1", reason, found)


def reach(work: Work, lines: Lines, carried: Vector, U: Vector, total: CosSin) -> None:
    """Solve for the joints that move in the arm plane, given the sum of their angles."""
    terms, turning = work.terms, in_plane(lines)
    if len(turning) < len(lines.axes[1:ARM]):
        telescope(work, lines.axes[1:ARM], carried, U, total)
    else:
        a2, a3, a4 = turning
        lever = rotated(terms, a2.h, total, subtracted(terms, carried, a4.p))
        triangle(work, a2, a3, a4.p, subtracted(terms, U, lever))
    remaining(work, turning, total)


def leave(work: Work, lines: Lines, first: int) -> None:
    """Set the joints from index ``first`` to 0, because the task does not determine them."""
    for axis in lines.axes[first:]:
        work.turns[axis.joint] = NO_TURN


def _across(lines: Lines) -> Vector:
    a1, a2 = lines.axes[0], in_plane(lines)[0]
    return perpendicular(lines.terms, a2.h, a1.h)
