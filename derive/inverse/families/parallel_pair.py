"""Three revolute joints with two adjacent parallel axes.

The tool orientation determines the angle of the third joint and the sum of the two parallel joints'
angles. The tool position determines the angle of the first of the two parallel joints. Maximum
number of solutions: 1.
"""

from ...terms.vectors import cross, subtracted
from ..steps.least_squares import step_on_all
from ..steps.rotations import last_turn
from ..steps.target import Target
from ..steps.triangle import remaining
from ..steps.work import Work
from ..structure.lines import Lines
from ..structure.requirement import Requirement, askew, parallel, revolute
from ..subproblems.sp1 import sp1
from ..subproblems.turns import rotated
from ..tasks.partial_poses import POSITION_TASK
from .family import Family


def _requires(lines: Lines) -> list[Requirement]:
    return [revolute(lines, range(3)), parallel(lines, 0, 1), askew(lines, 1, 2)]


def _solve(work: Work, lines: Lines, target: Target) -> None:
    terms, (a1, a2, a3) = work.terms, lines.axes
    # 1. The two parallel joints rotate axis 3 by the sum of their angles.
    q12 = work.step(
        [a1, a2],
        "subproblem 1",
        f"the parallel joints rotate axis {a3.name} together",
        sp1(terms, a1.h, a3.h, target.turned(terms, a3.h)),
    )
    # 2. The remaining rotation.
    e = cross(terms, a3.h, a1.h)
    last_turn(work, a3, e, target.turned(terms, e), [(a1, q12)])
    # 3. The target pose determines the position of axis 2.
    wanted = subtracted(terms, target.point(terms, a3.p), a1.p)
    fore = rotated(terms, a1.h, q12, subtracted(terms, a3.p, a2.p))
    work.step(
        [a1],
        "subproblem 1",
        f"the target pose determines the position of axis {a2.name}",
        sp1(terms, a1.h, subtracted(terms, a2.p, a1.p), subtracted(terms, wanted, fore)),
    )
    remaining(work, (a1, a2), q12)
    step_on_all(work, lines, target)


PARALLEL_PAIR = Family(
    "two parallel axes and a third axis",
    (3,),
    _requires,
    _solve,
    tasks=(POSITION_TASK,),
)
