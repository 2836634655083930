"""Planar arms and SCARAs, with up to three parallel revolute joints and with prismatic joints.

A prismatic joint along the parallel axes lifts the tool. In a cylindrical robot, a prismatic joint
perpendicular to two revolute axes replaces the third revolute joint. Maximum number of solutions:
2. An arm with two revolute joints and no perpendicular prismatic joint has 1 solution. For an
unreachable pose, the solution steps return the joint values of a nearby pose.
"""

import numpy as np
import sympy as sp

from ...chain.forward import Pose
from ...model.robot import SerialRobot
from ...model.tolerances import TOOL_ON_AXIS
from ...terms.symbolic_function import Argument
from ...terms.vectors import IDENTITY, subtracted
from ..steps.parallel_slides import lift, telescope
from ..steps.target import Target
from ..steps.triangle import remaining, triangle
from ..steps.work import Work
from ..structure.lines import Axis, Lines, home_of
from ..structure.requirement import Requirement, across, parallel
from ..subproblems.sp1 import sp1
from ..subproblems.turns import CosSin, any_across, rotated
from ..tasks.partial_poses import POSITION, POSITION_ENTRIES, partial_pose, tool_origin
from ..tasks.slots import larger, squares
from ..tasks.task import InputLetter, Solved, Task, TaskInput
from .family import Family

_MIN_TURNS, _MAX_TURNS = 2, 3
_FLAT = 0.1
"""A prismatic axis and a revolute axis count as perpendicular if the cosine of the angle between
them is below this value."""
_PHI = sp.Symbol("_phi", real=True)
_PHI_LETTER = InputLetter((r"\varphi", r"\rho", r"\Phi"))


def _requires(lines: Lines) -> list[Requirement]:
    turning = [k for k, axis in enumerate(lines.axes) if axis.turns]
    sliding = [k for k, axis in enumerate(lines.axes) if not axis.turns]
    fits = _MIN_TURNS <= len(turning) <= _MAX_TURNS and len(sliding) <= 1
    telescopic = _telescope_of(lines)
    if telescopic is not None:
        across_them = lines.axes.index(telescopic)
        others = [k for k in range(len(lines.axes)) if k != across_them]
        return [parallel(lines, *others), across(lines, across_them, turning[0])]
    count = Requirement(
        "two or three joints are revolute, and at most one is prismatic", 0.0 if fits else np.inf
    )
    return [count, parallel(lines, *turning, *sliding)] if fits else [count]


def _telescope_of(lines: Lines) -> Axis | None:
    turning = [axis for axis in lines.axes if axis.turns]
    sliding = [axis for axis in lines.axes if not axis.turns]
    if len(turning) != _MIN_TURNS or not 1 <= len(sliding) <= _MIN_TURNS:
        return None
    slopes = [abs(float(axis.direction @ turning[0].direction)) for axis in sliding]
    flattest = min(range(len(sliding)), key=slopes.__getitem__)
    return sliding[flattest] if slopes[flattest] < _FLAT else None


def _solve(work: Work, lines: Lines, target: Target) -> None:
    terms, telescopic = work.terms, _telescope_of(lines)
    turning = tuple(axis for axis in lines.axes if axis.turns)
    first = turning[0]
    hand, meaning = target.home, "the tool's origin"
    if len(turning) == _MAX_TURNS:
        hand, meaning = turning[2].p, f"a point of axis {turning[2].name}"
    wanted = work.name_vector(("W", "V"), meaning, target.point(terms, hand))
    W = subtracted(terms, wanted, first.p)
    # 1. Only the prismatic joint moves the tool along the parallel axes.
    for axis in lines.axes:
        if not axis.turns and axis is not telescopic:
            lift(work, axis, first, hand, W)
    if len(turning) == _MAX_TURNS:
        # 2, 3. A triangle.
        triangle(work, turning[0], turning[1], hand, W)
    # 4. The tool rotates by the sum of the joint angles.
    e = any_across(terms, first.h)
    total = work.step(
        turning,
        "subproblem 1",
        "the sum of these angles rotates the tool",
        sp1(terms, first.h, e, target.turned(terms, e)),
    )
    if telescopic is not None:
        # 2, 3. The prismatic joint sets the length of one side of the triangle of shoulder, elbow
        # and wrist.
        in_plane = tuple(axis for axis in lines.axes if axis.turns or axis is telescopic)
        telescope(work, in_plane, hand, W, total)
    elif len(turning) == _MIN_TURNS:
        # 2. The tool rotation and position determine the elbow position.
        elbow = turning[1].p
        fore = rotated(terms, first.h, total, subtracted(terms, hand, elbow))
        work.step(
            [first],
            "subproblem 1",
            f"the target pose determines the position of axis {turning[1].name}",
            sp1(terms, first.h, subtracted(terms, elbow, first.p), subtracted(terms, W, fore)),
        )
    remaining(work, turning, total)


def _lies_in_base_plane(robot: SerialRobot, lines: Lines) -> bool:
    upright = abs(float(lines.axes[0].direction[2])) > 1 - TOOL_ON_AXIS
    turning = all(axis.turns for axis in lines.axes)
    heading = abs(float(lines.terms.value(home_of(robot, lines.terms)[2, 0]))) < TOOL_ON_AXIS
    return turning and upright and heading


def _in_base_plane(robot: SerialRobot, lines: Lines) -> Solved:
    terms = lines.terms
    work = Work(terms)
    home = home_of(robot, terms)
    c, s = terms.cos_sin(_PHI)
    c0, s0 = terms.let(home[0, 0]), terms.let(home[1, 0])
    turn = CosSin(terms.let(c * c0 + s * s0), terms.let(s * c0 - c * s0))
    _, _, z = IDENTITY
    axes = ((turn.c, turn.s, z[0]), (-turn.s, turn.c, z[0]), z)
    tool = tool_origin(robot, terms)
    X, Y, _ = POSITION
    _solve(work, lines, Target(axes, tool, (X, Y, tool[2])))

    def residual(pose: Pose) -> sp.Expr:
        axes, origin = pose
        moved = squares(terms, (origin[0] - X, origin[1] - Y))
        return larger(terms, moved, squares(terms, (axes[0][0] - c, axes[0][1] - s)))

    meaning = "position and angle of the tool in the plane"
    return partial_pose(
        "ik_planar",
        robot,
        work,
        TaskInput(
            Argument("x", (X, Y, _PHI), (3,), "m, rad", meaning),
            (*POSITION_ENTRIES[:2], _PHI_LETTER),
        ),
        residual,
        "fk(q[k]) has its origin at x[:2] and its first axis at the angle x[2] if residual[k] is a "
        "rounding error",
        ("plane", "heading"),
    )


PLANAR = Family(
    "parallel axes",
    (2, 3, 4),
    _requires,
    _solve,
    tasks=(Task("ik_planar", _in_base_plane, _lies_in_base_plane),),
)
