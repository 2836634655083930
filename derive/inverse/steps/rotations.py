"""Solves for three revolute joints that produce a given rotation, as in a spherical wrist."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import sympy as sp
from sympy.logic.boolalg import Boolean

from ...model.tolerances import ALIGNED_AXES
from ...terms.vectors import Vector, cross, dot
from ..structure.lines import Axis, Lines
from ..subproblems.sp1 import sp1
from ..subproblems.sp2 import sp2
from ..subproblems.sp6 import chosen
from ..subproblems.turns import NO_TURN, CosSin, perpendicular, rotated
from .target import Target
from .work import Work


@dataclass(frozen=True)
class Aligned:
    """Solves for the first of three angles if the first and the third axis are parallel.

    Attributes:
        angle: Function that computes the first angle from the second angle and a sign.
        condition: Condition under which the function ``angle`` computes the first angle, in
            addition to the parallel axes.
        end: End of the sentence that explains the first angle in the LaTeX article.
    """

    angle: Callable[[CosSin, sp.Expr], CosSin]
    condition: Boolean = sp.true
    end: str = "then follows from the position"


def wrist(work: Work, lines: Lines, first: int, target: Target) -> None:
    """Solve for the angles of the three wrist joints.

    Args:
        work: Record of the solution, which already contains the joints before the wrist and
            receives the steps for the wrist joints.
        lines: The chain.
        first: Index of the first joint of the wrist.
        target: The pose that the chain must reach.
    """
    axes = lines.axes[first : first + 3]
    three_turns(
        work,
        (axes[0], axes[1], axes[2]),
        lambda v: turned_back(work, lines, first, target.turned(work.terms, v)),
    )


def three_turns(
    work: Work,
    axes: tuple[Axis, Axis, Axis],
    wanted: Callable[[Vector], Vector],
    aligned: Aligned | None = None,
) -> None:
    """Solve ``R_4 R_5 R_6 = R`` for the angles of three revolute joints.

    Subproblem 2 solves ``R_4 R_5 h_6 = R h_6`` for the first two angles, where h_6 is axis 6. A
    direction that is not parallel to h_6 then determines the last angle.

    Args:
        work: Records the steps.
        axes: The three axes.
        wanted: A function that applies the rotation R to a direction.
        aligned: Solves for joint 4 if axis 6 is parallel to axis 4. If axes 4 and 6 are parallel
            and `aligned` is None, joint 4 is set to 0.
    """
    terms = work.terms
    a4, a5, a6 = axes
    if a6.stays:
        two_turns(work, (a4, a5), wanted)
        work.turns[a6.joint] = NO_TURN
        return
    sign = work.sign()
    q4, q5 = sp2(terms, a4.h, a5.h, a6.h, wanted(a6.h), sign)
    end = "is then set to 0"
    if aligned is not None:
        image = wanted(a6.h)
        across = perpendicular(terms, a4.h, image)
        are_aligned = sp.And(dot(terms, across, across) < ALIGNED_AXES**2, aligned.condition)
        # For parallel axes 4 and 6, subproblem 2 has a double solution, which is accurate only to
        # 1e-8.
        middle = sp1(terms, a5.h, a6.h, image).turn
        first = aligned.angle(middle, sign)
        q4 = replace(q4, turn=chosen(terms, are_aligned, first, q4.turn))
        q5 = replace(q5, turn=chosen(terms, are_aligned, middle, q5.turn))
        end = aligned.end
    work.step(
        [a4],
        "subproblem 2",
        f"{a6.name} does not rotate its own axis, and {a5.name} does not change the component of "
        f"this axis along axis {a5.name}",
        q4,
        f"if axis {a6.name} is parallel to axis {a4.name}, only the sum of the two angles is "
        f"determined; this angle {end}",
    )
    reason = f"this joint produces the remaining rotation of axis {a6.name} after {a4.name}"
    work.step([a5], "subproblem 1", reason, q5)
    e = cross(terms, a6.h, a5.h)
    before = (a4, q4.turn), (a5, q5.turn)
    last_turn(work, a6, e, wanted(e), before, is_regular=q4.margin is None)


def two_turns(work: Work, axes: tuple[Axis, Axis], wanted: Callable[[Vector], Vector]) -> None:
    """Solve ``R_4 R_5 = R`` for two angles, with at most one solution.

    Subproblem 1 solves ``R_4 h_5 = R h_5`` for the first angle, and ``R_5 = R_4^T R`` for the
    second angle. Subproblem 1 always returns exactly one angle per equation.

    Args:
        work: Records the steps.
        axes: The two axes.
        wanted: A function that applies the rotation R to a direction.
    """
    terms = work.terms
    a4, a5 = axes
    q4 = work.step(
        [a4],
        "subproblem 1",
        f"{a5.name} does not rotate its own axis",
        sp1(terms, a4.h, a5.h, wanted(a5.h)),
    )
    e = cross(terms, a5.h, a4.h)
    last_turn(work, a5, e, wanted(e), [(a4, q4)])


def last_turn(
    work: Work,
    axis: Axis,
    e: Vector,
    wanted: Vector,
    before: Sequence[tuple[Axis, CosSin]],
    *,
    behind: str = "",
    is_regular: bool = False,
) -> None:
    """Solve for the angle of the last of several revolute joints.

    Args:
        work: Records the step.
        axis: The last axis.
        e: A direction perpendicular to the last axis.
        wanted: The direction that ``e`` must have after the rotations of all joints.
        before: The axes and rotations of all joints before the last joint, starting at the base.
        behind: Text that names the joints before the last joint, such as " after joints 1 to 5".
        is_regular: Whether ``wanted``, rotated back by the joints before the last joint, is
            perpendicular to the last axis for every target.
    """
    for other, turn in before:
        wanted = rotated(work.terms, other.h, turn.back, wanted)
    found = sp1(work.terms, axis.h, e, wanted, is_regular=is_regular)
    work.step([axis], "subproblem 1", f"this joint produces the remaining rotation{behind}", found)


def two_last_turns(
    work: Work,
    before: tuple[tuple[Axis, CosSin], tuple[Axis, CosSin]],
    last: tuple[Axis, Axis],
    target: Target,
    *,
    is_regular: bool,
) -> None:
    """Solve for joints 5 and 6 from the rotation that remains after joints 1 to 4.

    Args:
        work: Records the steps.
        before: Two pairs (axis, angle): joint 1 with its angle, and the parallel joints with the
            sum of their angles.
        last: The axes of joints 5 and 6.
        target: The pose that the chain must reach.
        is_regular: Whether the angle sum of the parallel joints solves its equation for every
            target.
    """
    terms, (a5, a6), ((a1, q1), (second, total)) = work.terms, last, before
    v = rotated(terms, a1.h, q1.back, target.turned(terms, a6.h))
    seen = rotated(terms, second.h, total.back, v)
    reason = "this joint produces the remaining rotation of axis 6 after joints 1 to 4"
    found = sp1(terms, a5.h, a6.h, seen, is_regular=is_regular)
    q5 = work.step([a5], "subproblem 1", reason, found)
    e = cross(terms, a6.h, a5.h)
    wanted = target.turned(terms, e)
    turned = (*before, (a5, q5))
    last_turn(work, a6, e, wanted, turned, behind=" after joints 1 to 5", is_regular=True)


def turned_back(work: Work, lines: Lines, count: int, v: Vector) -> Vector:
    """Express a base-frame direction in the frame after the first ``count`` joints."""
    for axis in lines.axes[:count]:
        if axis.turns:
            v = rotated(work.terms, axis.h, work.turns[axis.joint].back, v)
    return v
