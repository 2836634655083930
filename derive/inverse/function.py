"""From a solved chain to the function that is generated: every slot with its residual and margin."""

from collections.abc import Sequence

import sympy as sp

from ..chain import groups
from ..forward import Forward, Pose
from ..function import Argument, Result, SymbolicFunction
from ..kinematics import common_unit
from ..robot import Robot
from ..scope import Scope
from .work import Work

POSE_SYMBOLS = tuple(
    sp.Symbol(name, real=True)
    for name in (
        *("_r11", "_r12", "_r13", "_p1", "_r21", "_r22", "_r23", "_p2"),
        *("_r31", "_r32", "_r33", "_p3", "_r41", "_r42", "_r43", "_p4"),
    )
)
"""The entries of a pose, row by row; names in robot files can not begin with an underscore."""


def pose_argument(robot: Robot) -> Argument:
    """The argument ``T``: the pose that the tool is to have."""
    meaning = f"pose of the tool, T_{robot.base_frame}_{robot.tool_frame}"
    return Argument("T", POSE_SYMBOLS, (4, 4), "1, m", meaning)


def values_of(work: Work, robot: Robot) -> list[sp.Expr]:
    """The value of every moving joint: an atan2 where it turns."""
    return [
        work.lengths[k]
        if joint.kind == "prismatic"
        else work.scope.solved_angle(work.turns[k].c, work.turns[k].s)
        for k, joint in enumerate(robot.moving)
    ]


def tool_of(scope: Scope, robot: Robot, values: Sequence[sp.Expr]) -> Pose:
    """Where the tool comes with these joint values: forward kinematics on cosines and sines."""
    return Forward(scope, groups(robot, scope, values)).tool_pose()


def pose_residual(scope: Scope, pose: Pose, wanted: Sequence[sp.Expr]) -> sp.Expr:
    """How far a pose is from the one wanted: metre or radian, the larger of the two.

    The distance of two rotation matrices in the Frobenius norm is sqrt(8) sin(angle / 2), for small
    angles sqrt(2) of the angle between them.
    """
    axes, origin = pose
    moved = [scope.let(origin[i] - wanted[4 * i + 3]) for i in range(3)]
    turned = [scope.let(axes[j][i] - wanted[4 * i + j]) for i in range(3) for j in range(3)]
    distance2 = scope.let(sum((x**2 for x in moved), sp.Integer(0)))
    angle2 = scope.let(scope.let(sum((x**2 for x in turned), sp.Integer(0))) / 2)
    return scope.let(sp.sqrt(sp.Max(distance2, angle2, evaluate=False)))


def margin_of(work: Work) -> sp.Expr:
    """The smallest margin of all steps; 1 where no step can fail."""
    margins = work.margins()
    if not margins:
        return sp.Integer(1)
    least = margins[0]
    for margin in margins[1:]:
        least = work.scope.let(sp.Min(least, margin, evaluate=False))
    return least


def branches(
    name: str,
    robot: Robot,
    work: Work,
    inputs: tuple[Argument, ...],
    values: Sequence[sp.Expr],
    residual: sp.Expr,
) -> SymbolicFunction:
    """The function of one task over all slots."""
    k, n = 2 ** len(work.signs), len(robot.coordinates)
    q = tuple(
        joint.direction * value for joint, value in zip(robot.coordinates, values, strict=True)
    )
    unit = common_unit([joint.unit for joint in robot.coordinates])
    return SymbolicFunction(
        name,
        f"Every solution of the inverse kinematics, in {k} slots.",
        "fk(q[k]) = T wherever residual[k] is rounding",
        inputs,
        (
            Result("q", q, (k, n), unit, "joint coordinates, one solution a row"),
            Result("residual", (residual,), (k,), "m or rad", "distance of fk(q[k]) from T"),
            Result(
                "margin",
                (margin_of(work),),
                (k,),
                "1",
                "distance from the boundary of what can be reached, negative beyond",
            ),
        ),
        work.scope,
        signs=tuple(work.signs),
    )
