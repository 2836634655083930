"""A rotating base, three parallel revolute joints and an optional fifth joint.

Axes 2, 3 and 4 are parallel. Axis 1 is perpendicular to the parallel axes. If there is a fifth
axis, it is also perpendicular to the parallel axes. Four joints control the position of the tool
and the pitch of the tool in the arm plane. A fifth joint rotates the tool about an axis in the
plane of the arm. For an unreachable pose, the solution steps return the joint values of a nearby
pose. The residual is the distance between the reached pose and the target pose.

A pose has at most 4 solutions for an arm with five joints, and at most 2 for an arm with four
joints. A tool position with a pitch angle has up to 8 solutions, because the tool may point outward
or inward.
"""

import sympy as sp

from ...model.robot import SerialRobot
from ...model.tolerances import TOOL_ON_AXIS
from ...terms.terms import Terms
from ...terms.vectors import Vector, added, dot, subtracted
from ..coupled_chain import CoupledChain
from ..steps.plane import ARM, arm_in_plane, in_plane, leave, reach, turned_as_one, turned_to_plane
from ..steps.triangle import triangle
from ..steps.work import Work
from ..structure.lines import Lines
from ..structure.requirement import Requirement, across, parallel, revolute
from ..subproblems.found import FoundTurn
from ..subproblems.quartic import select
from ..subproblems.sp1 import sp1
from ..subproblems.sp3 import sp3
from ..subproblems.turns import NO_TURN, CosSin, perpendicular, rotated
from ..tasks.partial_poses import POSITION, position, tool_origin
from ..tasks.task import Solved, Task
from ..tasks.tool_in_plane import WITH_DIRECTION, WITH_PITCH, off_axis
from .family import Family


def _requires(lines: Lines) -> list[Requirement]:
    return [
        revolute(lines, range(len(lines.axes))),
        parallel(lines, 1, 2, 3),
        across(lines, 0, 1),
        *(across(lines, k, 1) for k in range(ARM, len(lines.axes))),
    ]


def _keeps_position(robot: SerialRobot, lines: Lines) -> bool:
    return len(lines.axes) <= ARM or bool(off_axis(robot, lines, ARM)[0] < TOOL_ON_AXIS)


def _with_position(robot: SerialRobot, lines: Lines) -> Solved:
    terms, (_, a2, a3, a4, *_) = lines.terms, lines.axes
    work = Work(terms)
    tool = tool_origin(robot, terms)
    U, _ = turned_to_plane(work, lines, tool, POSITION)
    hand = tool
    if off_axis(robot, lines, ARM - 1)[0] < TOOL_ON_AXIS:
        work.turns[a4.joint] = NO_TURN
    else:
        lever = subtracted(terms, tool, a4.p)
        bent = work.step(
            [a4],
            "subproblem 3",
            "the distance from elbow to tool must be a possible side of the arm triangle",
            _bent_least(terms, lines, lever, U),
            "if the distance is possible with this joint at 0, the joint is set to 0",
        )
        hand = added(terms, a4.p, rotated(terms, a4.h, bent, lever))
    triangle(work, a2, a3, hand, U)
    leave(work, lines, ARM)
    return position(robot, work)


def _bent_least(terms: Terms, lines: Lines, lever: Vector, U: Vector) -> FoundTurn:
    """Return the smallest angle of joint 4 for which the elbow can reach the target.

    Shoulder, elbow and wrist form a triangle if the elbow-wrist distance is between the difference
    and the sum of the other two sides. Angle 4 determines the elbow-wrist distance. Among the
    elbow-wrist distances that form a triangle, the function selects the distance nearest to the
    distance at angle 4 = 0.
    """
    let, (_, a2, a3, a4, *_) = terms.let, lines.axes
    fore, hand, upper, displacement = (
        perpendicular(terms, a2.h, v)
        for v in (subtracted(terms, a4.p, a3.p), lever, subtracted(terms, a3.p, a2.p), U)
    )
    r, a, straight = (
        let(sp.sqrt(dot(terms, v, v))) for v in (displacement, upper, added(terms, fore, hand))
    )
    least, most = let(sp.Abs(let(r - a))), let(r + a)
    length = let(sp.Max(least, sp.Min(straight, most, evaluate=False), evaluate=False))
    found = sp3(terms, a4.h, fore, hand, let(length**2), sp.Integer(1))
    stays = sp.And(straight >= least, straight <= most)
    turn = CosSin(
        select(terms, stays, sp.Integer(1), found.turn.c),
        select(terms, stays, sp.Integer(0), found.turn.s),
    )
    return FoundTurn(turn, found.equation)


def level_position(chain: CoupledChain, lines: Lines) -> Solved | None:
    """Return the task for a position if couplings fix the hand's orientation in the arm plane.

    In a palletizer, for example, couplings keep the hand level. If couplings fix the hand's
    orientation, the sum of the parallel joints' angles is constant.

    Args:
        chain: Chain of an arm with coupled joints. The axes of this chain satisfy the conditions of
            the turntable family.
        lines: The axes of the chain.

    Returns:
        The position task, or None if the angle sum of the parallel joints is not constant or if a
        fifth joint moves the tool origin.
    """
    robot, terms, arm = chain.robot, lines.terms, in_plane(lines)
    senses = sp.zeros(1, chain.C.rows)
    for axis in arm:
        senses[axis.joint] = 1 if float(axis.direction @ arm[0].direction) > 0 else -1
    if any(senses * chain.C) or not _keeps_position(robot, lines):
        return None
    ((total,),) = (senses * chain.c).tolist()
    work, tool, h = Work(terms), tool_origin(robot, terms), arm[0].h
    U, _ = turned_to_plane(work, lines, tool, POSITION)
    e = perpendicular(terms, h, lines.axes[0].h)
    level = sp1(terms, h, e, rotated(terms, h, CosSin(*terms.cos_sin(total)), e))
    hand = turned_as_one(
        work, lines, level, "the couplings keep the orientation of the tool in the arm plane"
    )
    reach(work, lines, tool, U, hand)
    leave(work, lines, ARM)
    return position(robot, work)


TURNTABLE = Family(
    "a turntable with three parallel axes",
    (4, 5),
    _requires,
    arm_in_plane,
    tasks=(
        Task("ik_position", _with_position, _keeps_position),
        WITH_PITCH,
        WITH_DIRECTION,
    ),
    coupled_position=level_position,
)
