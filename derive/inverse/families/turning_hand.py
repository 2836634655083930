"""Four joints: three joints of any kind that position a point, and a revolute joint after them.

Joint 4 does not move the points on its axis. The target thus determines the position of a point on
axis 4, and the first three joints reach this position. The remaining rotation determines joint 4.
The residual includes the other conditions of the pose. Maximum number of solutions: 4.
"""

import numpy as np
import sympy as sp

from ...terms.vectors import Vector, combination
from ..steps import three_joints
from ..steps.least_squares import step_on_all
from ..steps.rotations import last_turn
from ..steps.target import Target
from ..steps.work import Work
from ..structure.lines import Lines
from ..structure.rank import directions_at_right_angles, moves_in_space
from ..structure.requirement import Requirement, revolute
from ..subproblems.turns import any_across
from .family import Family


def _requires(lines: Lines) -> list[Requirement]:
    arm = _arm(lines)
    moves = bool(_moved_points(lines)) if lines.axes[3].turns else False
    text = f"the joints before {lines.axes[3].name} move a point of its axis in three directions"
    return [
        revolute(lines, (3,)),
        three_joints.requires(arm),
        Requirement(text, 0.0 if moves else np.inf),
    ]


def _solve(work: Work, lines: Lines, target: Target) -> None:
    terms, arm, a4 = work.terms, _arm(lines), lines.axes[3]
    case, point = three_joints.case_of(arm), _moved_points(lines)[0]
    assert case is not None
    # 1 to 3. Joint 4 does not move the points on its axis.
    meaning = f"a point of axis {a4.name}"
    case.solve(work, arm, point, work.name_vector(("W", "V"), meaning, target.point(terms, point)))
    # 4. The remaining rotation.
    before = [(axis, work.turns[axis.joint]) for axis in arm.axes if axis.turns]
    e = any_across(terms, a4.h)
    last_turn(work, a4, e, target.turned(terms, e), before)
    # 5. The pose has more conditions than solution steps 1 to 4 use.
    step_on_all(work, lines, target)


def _moved_points(lines: Lines) -> list[Vector]:
    """Returns points of axis 4 that the first three joints move in three directions.

    The first point is the point that moves in the most directions if the joints are at right
    angles. For example, a point at the intersection of two joint axes does not determine the angles
    of these joints.
    """
    terms, a4, arm = lines.terms, lines.axes[3], _arm(lines)
    size = sp.Rational(f"{lines.length or 1.0:.0e}")
    found: list[tuple[int, Vector]] = []
    for along in (sp.S.Zero, size, -size):
        there = a4.origin + float(along) * a4.direction
        if moves_in_space(arm, there):
            point = combination(terms, (sp.S.One, along), (a4.p, a4.h))
            found.append((directions_at_right_angles(arm, there), point))
    return [point for _, point in sorted(found, key=lambda each: -each[0])]


def _arm(lines: Lines) -> Lines:
    return Lines(lines.terms, lines.axes[:3], lines.tolerance)


# If the axes were numbered from the tool, the inverse would miss poses of arms with right angles.
TURNING_HAND = Family(
    "three joints and a hand that turns", (4,), _requires, _solve, readings=("base",)
)
