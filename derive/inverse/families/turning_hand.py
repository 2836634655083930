"""Arms with four joints: three joints of any kind, followed by a revolute joint.

Joint 4 does not move the points on its axis. The target pose determines the position of a point on
axis 4. The first three joints move a point on axis 4 to its target position. Joint 4 produces the
remaining tool rotation. The solution steps use only some components of the target pose. The
residual includes the errors of the pose components that the solution steps do not use. Maximum
number of solutions: 4.
"""

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from ...terms.vectors import Vector, combination
from ..steps import three_joints
from ..steps.least_squares import step_on_all
from ..steps.rotations import last_turn
from ..steps.target import Target
from ..steps.work import Work
from ..structure.lines import SOME_SLIDE, Lines
from ..structure.rank import directions_at_right_angles, moves_in_space
from ..structure.requirement import Requirement, revolute
from ..subproblems.turns import any_across
from .family import Family

_PARTS = tuple(sp.Rational(k, part) for part in (1, 2, 3, 4) for k in (0, 1, -1) if k or part == 1)
"""Signed distances of the candidate points on axis 4 from the origin of this axis, divided by the
arm length."""


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
    case, point = three_joints.case_of(arm), _best_point(lines)
    assert case is not None
    # 1 to 3. Joint 4 does not move the points on its axis.
    meaning = f"a point of axis {a4.name}"
    case.solve(work, arm, point, work.name_vector(("W", "V"), meaning, target.point(terms, point)))
    # 4. The remaining rotation.
    before = [(axis, work.turns[axis.joint]) for axis in arm.axes if axis.turns]
    e = any_across(terms, a4.h)
    last_turn(work, a4, e, target.turned(terms, e), before)
    # 5. Steps 1 to 4 do not use all components of the pose. A Gauss-Newton step on all joints
    # reduces the error of the full pose.
    step_on_all(work, lines, target)


def _moved_points(lines: Lines) -> list[sp.Expr]:
    """Return the candidate points on axis 4 that joints 1 to 3 can move in three directions.

    Each returned point is represented by its signed distance from the origin of axis 4.
    """
    size = sp.Rational(f"{lines.length or 1.0:.0e}")
    points = [part * size for part in _PARTS]
    return [along for along in points if moves_in_space(_arm(lines), _there(lines, float(along)))]


def _best_point(lines: Lines) -> Vector:
    """Return the point of axis 4 that best determines joints 1 to 3.

    If a point of axis 4 also lies on an earlier joint axis, the position of this point does not
    determine the angle of the earlier joint.

    The function selects the candidate point that determines the most joint angles. The rating of a
    candidate point is at most the rating of a generic point of axis 4. Among equally good points,
    the first point is selected.
    """
    arm, points = _arm(lines), _moved_points(lines)
    most = directions_at_right_angles(arm, _there(lines, SOME_SLIDE * (lines.length or 1.0)))

    def directions(along: sp.Expr) -> int:
        return min(directions_at_right_angles(arm, _there(lines, float(along))), most)

    best = max(points, key=directions)
    return combination(lines.terms, (sp.S.One, best), (lines.axes[3].p, lines.axes[3].h))


def _there(lines: Lines, along: float) -> NDArray[np.float64]:
    return lines.axes[3].origin + along * lines.axes[3].direction


def _arm(lines: Lines) -> Lines:
    return Lines(lines.terms, lines.axes[:3], lines.tolerance)


# The family TURNING_HAND is tried only with axes that are numbered from the base. With axes
# numbered from the tool, the function ik of an arm with right angles would find no solution for
# some poses.
TURNING_HAND = Family(
    "three joints and a revolute wrist joint", (4,), _requires, _solve, readings=("base",)
)
