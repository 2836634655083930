"""An arm or a prismatic joint, followed by a rod between universal joints.

Axes 1 and 2 are parallel. Axes 3 and 4 are parallel to each other and perpendicular to axis 1. Axis
5 is perpendicular to axis 4. The axes of a universal joint need not intersect. The legs of a rotary
delta (R-U-U) have this structure if their rods have printed universal joints.

In a linear delta (P-U-U), joint 1 is prismatic, and its direction is perpendicular to axis 2. Joint
1 moves axis 2, and joint 2 moves the end of the rod on a circle about axis 2.

Joints 1 and 2 preserve vector components along axis 2, so the direction of axis 5 determines the
sum of angles 3 and 4. The position of a point on axis 5 determines angle 3. If the tool is oriented
like the base, the sum of angles 3 and 4 is 0, and the two solutions for this sum coincide. A
triangle determines angles 1 and 2. Because angles 1 and 2 also determine the tool orientation, the
arm does not reach most poses exactly, and the residual is not 0.

Maximum number of solutions: 8.
"""

import sympy as sp

from ...terms.vectors import added, combination, cross, dot, subtracted
from ..steps.target import Target
from ..steps.triangle import remaining, triangle
from ..steps.two_joints import two_joints
from ..steps.work import Work
from ..structure.lines import Axis, Lines
from ..structure.requirement import Requirement, across, parallel, revolute
from ..subproblems.equations import Direction
from ..subproblems.found import FoundTurn
from ..subproblems.sp1 import sp1
from ..subproblems.sp4 import sp4
from ..subproblems.turns import CosSin, any_across, direction, rotated
from .family import Family


def _requires(lines: Lines) -> list[Requirement]:
    slides = not lines.axes[0].turns
    return [
        revolute(lines, range(1 if slides else 0, 5)),
        across(lines, 0, 1) if slides else parallel(lines, 0, 1),
        parallel(lines, 2, 3),
        across(lines, 1, 2),
        across(lines, 3, 4),
    ]


def _solve(work: Work, lines: Lines, target: Target) -> None:
    terms, (first, second, third, fourth, fifth) = work.terms, lines.axes
    # Joints 1 and 2 do not change the component of a vector along the axis `kept`.
    kept = first if first.turns else second
    both = f"joints {first.name} and {second.name}"
    along = "their axes" if first.turns else f"axis {second.name}"
    # 1. The direction of axis 5 determines the sum of angles 3 and 4.
    total = work.step(
        [third, fourth],
        "subproblem 1",
        f"{both} do not change the component of axis {fifth.name} along {along}",
        _tilt(work, lines, kept, target),
    )
    # 2. The position of a point on axis 5 determines angle 3.
    wrist = work.name_vector(
        ("W", "V"), f"a point of axis {fifth.name}", target.point(terms, fifth.p)
    )
    hand = rotated(terms, third.h, total, subtracted(terms, fifth.p, fourth.p))
    rod = subtracted(terms, fourth.p, third.p)
    rest = subtracted(terms, subtracted(terms, wrist, third.p), hand)
    bent = work.step(
        [third],
        "subproblem 4",
        f"{both} do not change the component of the point along {along}",
        sp4(terms, kept.h, third.h, rod, dot(terms, kept.h, rest), work.sign()),
    )
    remaining(work, (third, fourth), total)
    # 3, 4. If joint 1 is revolute, its arm, the rod and the wrist form a triangle. If joint 1 is
    # prismatic, the end of the rod moves on a circle about axis 2.
    turned = added(terms, third.p, rotated(terms, third.h, bent, rod))
    end = added(terms, turned, hand)
    if first.turns:
        triangle(work, first, second, end, subtracted(terms, wrist, first.p))
    else:
        two_joints(work, first, second, end, wrist)
    # 5. The orientation.
    e = any_across(terms, fifth.h)
    aim = target.turned(terms, e)
    for axis in (axis for axis in lines.axes[:4] if axis.turns):
        aim = rotated(terms, axis.h, work.turns[axis.joint].back, aim)
    found = sp1(terms, fifth.h, e, aim)
    work.step([fifth], "subproblem 1", "the other joints are known", found)


def _tilt(work: Work, lines: Lines, kept: Axis, target: Target) -> FoundTurn:
    """Return the angle sum of joints 3 and 4 that gives axis 5 its target angle to axis ``kept``.

    The sine of the angle between the axes is computed as the norm of a cross product. A small sine
    would be inaccurate if it were computed from the cosine.
    """
    terms, third, fifth = work.terms, lines.axes[2], lines.axes[4]
    aim = target.turned(terms, fifth.h)
    over = cross(terms, kept.h, aim)
    along, aside = dot(terms, kept.h, aim), terms.let(sp.sqrt(dot(terms, over, over)))
    sign = work.sign()
    side = cross(terms, third.h, kept.h)
    wanted = combination(terms, (along, terms.let(sign * aside)), (kept.h, side))
    x, y = dot(terms, fifth.h, wanted), dot(terms, cross(terms, third.h, fifth.h), wanted)
    turn: CosSin = direction(terms, x, y)
    return FoundTurn(turn, Direction(x, y), sign if isinstance(sign, sp.Symbol) else None)


UNIVERSAL_ROD = Family(
    "an arm or a prismatic joint, and a rod between universal joints", (5,), _requires, _solve
)
