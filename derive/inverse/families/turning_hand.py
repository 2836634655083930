"""Four joints: three joints of any kind that position a point, and a revolute joint after them.

Joint 4 does not move the points of its axis. The target thus determines the position of such a
point, and the first three joints reach this position. The remaining rotation determines joint 4.
The residual includes the other conditions of the pose. Maximum number of solutions: 4.
"""

from collections.abc import Iterator

import numpy as np
import sympy as sp

from ...terms.vectors import Vector, combination
from ..steps import three_joints
from ..steps.least_squares import step_on_all
from ..steps.rotations import last_turn
from ..steps.target import Target
from ..steps.work import Work
from ..structure.lines import Lines
from ..structure.rank import moves_in_space
from ..structure.requirement import Requirement, revolute
from ..subproblems.turns import any_across
from .family import Family


def _requires(lines: Lines) -> list[Requirement]:
    arm = _arm(lines)
    moves = next(_moved_points(lines), None) is not None if lines.axes[3].turns else False
    text = f"the joints before {lines.axes[3].name} move a point of its axis in three directions"
    return [
        revolute(lines, (3,)),
        three_joints.requires(arm),
        Requirement(text, 0.0 if moves else np.inf),
    ]


def _solve(work: Work, lines: Lines, target: Target) -> None:
    terms, arm, a4 = work.terms, _arm(lines), lines.axes[3]
    case, point = three_joints.case_of(arm), next(_moved_points(lines))
    assert case is not None
    # 1 to 3. Joint 4 does not move the points of its axis.
    meaning = f"a point of axis {a4.name}"
    case.solve(work, arm, point, work.name_vector(("W", "V"), meaning, target.point(terms, point)))
    # 4. The remaining rotation.
    before = [(axis, work.turns[axis.joint]) for axis in arm.axes if axis.turns]
    e = any_across(terms, a4.h)
    last_turn(work, a4, e, target.turned(terms, e), before)
    # 5. The pose has more conditions than these solution steps use.
    step_on_all(work, lines, target)


def _moved_points(lines: Lines) -> Iterator[Vector]:
    """Yields points of axis 4 that the first three joints move in three directions."""
    terms, a4 = lines.terms, lines.axes[3]
    size = sp.Rational(f"{lines.length or 1.0:.0e}")
    for along in (sp.S.Zero, size, -size):
        if moves_in_space(_arm(lines), a4.origin + float(along) * a4.direction):
            yield combination(terms, (sp.S.One, along), (a4.p, a4.h))


def _arm(lines: Lines) -> Lines:
    return Lines(lines.terms, lines.axes[:3], lines.tolerance)


# If the axes were numbered from the tool, arms with right angles would lose poses.
TURNING_HAND = Family(
    "three joints and a hand that turns", (4,), _requires, _solve, readings=("base",)
)
