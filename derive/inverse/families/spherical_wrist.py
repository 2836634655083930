"""Six joints whose last three are revolute and meet in one point: the spherical wrist.

The centre of the wrist is reached by the first three joints (:mod:`.three_joints`), then the wrist
turns the tool. Most solutions: twice those of the first three.

Source: Pieper 1968; Elias and Wen 2022, 4.1.
"""

from collections.abc import Callable

from ...terms.vectors import Vector, cross
from ..steps import three_joints
from ..steps.target import Target
from ..steps.work import Work
from ..structure.lines import Axis, Lines
from ..structure.requirement import Requirement, meeting, revolute
from ..subproblems.sp1 import sp1
from ..subproblems.sp2 import sp2
from ..subproblems.turns import rotated

TITLE = "spherical wrist"


def requires(lines: Lines) -> list[Requirement]:
    """What the axes must fulfil."""
    return [
        revolute(lines, range(3, 6)),
        meeting(lines, 3, 4, 5),
        three_joints.requires(_arm(lines)),
    ]


def solve(work: Work, lines: Lines, target: Target) -> None:
    """All six joints for a target."""
    terms = work.terms
    # 1 to 3. The wrist does not move its centre.
    arm = _arm(lines)
    case = three_joints.case_of(arm)
    assert case is not None
    centre = lines.meeting(5, 4)
    W = work.call("W", "the wrist's centre", target.point(terms, centre))
    case.solve(work, arm, centre, W)
    # 4 to 6. What the arm leaves of the turn.
    wrist(work, lines, 3, target)


def wrist(work: Work, lines: Lines, first: int, target: Target) -> None:
    """Three revolute joints that make the rotation which those before them leave."""
    axes = lines.axes[first : first + 3]
    three_turns(
        work,
        (axes[0], axes[1], axes[2]),
        lambda v: _past(work, lines, first, target.turned(work.terms, v)),
    )


def three_turns(
    work: Work, axes: tuple[Axis, Axis, Axis], wanted: Callable[[Vector], Vector]
) -> None:
    """Three angles of a given rotation, ``R_4 R_5 R_6 = R``.

    ``R_4 R_5 h_6 = R h_6`` is subproblem 2. Any other direction then tells the last angle.

    Args:
        work: Gathers the steps.
        axes: The three axes.
        wanted: What the rotation makes of a direction.
    """
    terms = work.terms
    a4, a5, a6 = axes
    q4, q5 = sp2(terms, a4.h, a5.h, a6.h, wanted(a6.h), work.sign())
    work.step(
        [a4],
        "subproblem 2",
        f"{a6.name} does not turn its own axis, and {a5.name} keeps its part along axis {a5.name}",
        q4,
        f"with axis {a6.name} on axis {a4.name} only the sum of the two is determined; this one is "
        "then 0",
    )
    work.step([a5], "subproblem 1", f"what {a4.name} leaves of the turn of axis {a6.name}", q5)
    e = cross(terms, a6.h, a5.h)
    left = rotated(terms, a5.h, q5.turn.back, rotated(terms, a4.h, q4.turn.back, wanted(e)))
    work.step(
        [a6],
        "subproblem 1",
        "what is left of the turn",
        sp1(terms, a6.h, e, left, sure=q4.margin is None),
    )


def _past(work: Work, lines: Lines, count: int, v: Vector) -> Vector:
    """A direction in base axes, turned back by the joints before."""
    for axis in lines.axes[:count]:
        if axis.turns:
            v = rotated(work.terms, axis.h, work.turns[axis.joint].back, v)
    return v


def _arm(lines: Lines) -> Lines:
    return Lines(lines.terms, lines.axes[:3], lines.tolerance)
