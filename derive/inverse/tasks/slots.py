"""Builds the generated function that solves the inverse kinematics of a chain."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import product

import sympy as sp

from ...chain.forward import Forward, Pose
from ...chain.groups import groups
from ...chain.kinematics import common_unit
from ...model.robot import SerialRobot
from ...terms.role import Role, branch_label, side_of
from ...terms.symbolic_function import Argument, Result, SymbolicFunction
from ...terms.terms import Terms
from ..steps.work import Sum, Work
from ..subproblems.turns import NO_TURN
from .task import Solved, TaskInput

POSE_SYMBOLS = tuple(
    sp.Symbol(name, real=True)
    for name in (
        *("_r11", "_r12", "_r13", "_p1", "_r21", "_r22", "_r23", "_p2"),
        *("_r31", "_r32", "_r33", "_p3", "_r41", "_r42", "_r43", "_p4"),
    )
)
"""Symbols of the pose entries, row by row."""
ROUNDING = sp.Rational(1, 2**52)
"""Relative rounding error of a double."""


def pose_argument(robot: SerialRobot) -> Argument:
    """Return the argument ``T``, which is the target pose of the tool."""
    meaning = f"pose of the tool, T_{robot.base_frame}_{robot.tool_frame}"
    return Argument("T", POSE_SYMBOLS, (4, 4), "1, m", meaning)


def given_argument(robot: SerialRobot, joint: int, symbol: sp.Symbol) -> Argument:
    """Return the input argument for the value of a fixed joint.

    Args:
        robot: The description.
        joint: Index of the joint among the moving joints.
        symbol: Symbol of the joint coordinate.
    """
    moving = robot.moving[joint]
    meaning = f"the value of the fixed joint {moving.name}"
    return Argument(symbol.name.lstrip("_"), (symbol,), (), moving.unit, meaning)


def values_of(work: Work, robot: SerialRobot, given: Mapping[int, sp.Expr]) -> list[sp.Expr]:
    """Return the value of every moving joint, with angles as atan2 expressions."""
    values = [_value(work, k, given) for k in range(len(robot.moving))]
    for known in work.sums:
        *others, (last, _) = known.senses
        if others[1:] and last not in given:
            values[last] = _rest(work, known, values)
        total = sum((sense * values[k] for k, sense in known.senses), sp.Integer(0))
        work.terms.know_sum(total, known.turn.c, known.turn.s)
    return values


def _rest(work: Work, known: Sum, values: Sequence[sp.Expr]) -> sp.Expr:
    """Return the last angle of several parallel joints from the angle sum and the other angles."""
    *others, (last, sense) = known.senses
    before = sum((sign * values[k] for k, sign in others), sp.Integer(0))
    turn = work.turns[last]
    angle = sense * (work.terms.solved_angle(known.turn.c, known.turn.s) - before)
    return work.terms.solved_rest(angle, turn.c, turn.s)


def _value(work: Work, joint: int, given: Mapping[int, sp.Expr]) -> sp.Expr:
    if joint in given:
        return given[joint]
    if joint in work.lengths:
        return work.lengths[joint]
    turn = work.turns[joint]
    return sp.Integer(0) if turn == NO_TURN else work.terms.solved_angle(turn.c, turn.s)


def tool_of(terms: Terms, robot: SerialRobot, values: Sequence[sp.Expr]) -> Pose:
    """Return the tool pose from the cosines and sines of the joint values."""
    return Forward(terms, groups(robot, terms, values)).tool_pose()


def pose_residual(terms: Terms, pose: Pose, wanted: Sequence[sp.Expr]) -> sp.Expr:
    """Return the larger of position error (meter) and orientation error (radian).

    The Frobenius distance between two rotation matrices is sqrt(8) sin(angle / 2). For small
    rotation angles, the Frobenius distance of two rotation matrices is sqrt(2) times the angle.
    """
    moved, turned = pose_errors(pose, wanted)
    return larger(terms, squares(terms, moved), terms.let(squares(terms, turned) / 2))


def pose_errors(pose: Pose, wanted: Sequence[sp.Expr]) -> tuple[list[sp.Expr], list[sp.Expr]]:
    """Return the position error (meter) and the differences of the rotation entries."""
    axes, origin = pose
    moved = [origin[i] - wanted[4 * i + 3] for i in range(3)]
    return moved, [axes[j][i] - wanted[4 * i + j] for i in range(3) for j in range(3)]


def squares(terms: Terms, values: Iterable[sp.Expr]) -> sp.Expr:
    """Return the sum of the squared values as a named term."""
    return terms.let(sum((terms.let(value) ** 2 for value in values), sp.Integer(0)))


def larger(terms: Terms, distance2: sp.Expr, angle2: sp.Expr) -> sp.Expr:
    """Return the residual, the square root of the larger of ``distance2`` and ``angle2``.

    If the squared distance or the squared angle is NaN, the residual is NaN. The C function fmax is
    not used, because it ignores NaN. With fmax, a pose whose loops cannot be closed would count as
    solved.

    The larger value is computed with absolute values instead of a comparison, because a SymPy
    comparison of real numbers would not propagate NaN.
    """
    twice = terms.let(distance2 + angle2) + terms.let(sp.Abs(terms.let(distance2 - angle2)))
    return terms.let(sp.sqrt(terms.let(terms.let(twice) / 2)))


def with_rounding(terms: Terms, residual: sp.Expr, lengths: Iterable[sp.Expr]) -> sp.Expr:
    """Add the rounding error of prismatic coordinates to a residual.

    Almost parallel prismatic axes lead to coordinates of 1e15 m. The rounding errors of these large
    coordinates cancel in the residual. In a pose from another formula, such as ``fk``, the rounding
    errors of large coordinates do not cancel.
    """
    sizes = [terms.let(sp.Abs(length)) for length in lengths if length.free_symbols]
    return terms.let(residual + ROUNDING * sp.Add(*sizes)) if sizes else residual


def margin_of(work: Work, loops: Sequence[sp.Expr] = ()) -> sp.Expr:
    """Return the smallest margin of all solution steps and loops.

    If no solution step or loop has a margin, the returned margin is 1.
    """
    margins = [*work.margins(), *loops]
    if not margins:
        return sp.Integer(1)
    least = margins[0]
    for margin in margins[1:]:
        least = work.terms.let(sp.Min(least, margin, evaluate=False))
    return least


def of_pose_task(
    robot: SerialRobot,
    work: Work,
    arguments: tuple[Argument, ...],
    given: Mapping[int, sp.Expr],
    inputs: tuple[TaskInput, ...] = (),
) -> Solved:
    """Return the solution of the task ``ik``, whose target is the tool pose.

    Args:
        robot: The description.
        work: The record of the solution.
        arguments: The arguments for the values of fixed joints.
        given: The fixed joint values, keyed by joint index.
        inputs: Additional inputs that the arm family needs, such as a swivel angle.
    """
    terms = work.terms
    values = values_of(work, robot, given)
    residual = pose_residual(terms, tool_of(terms, robot, values), POSE_SYMBOLS)
    identity = "fk(q[k]) = T if residual[k] is a rounding error"
    first = (pose_argument(robot), *arguments)
    return branches("ik", robot, work, first, values, residual, identity, given, inputs)


def branches(
    name: str,
    robot: SerialRobot,
    work: Work,
    arguments: tuple[Argument, ...],
    values: Sequence[sp.Expr],
    residual: sp.Expr,
    identity: str,
    given: Iterable[int] = (),
    inputs: tuple[TaskInput, ...] = (),
) -> Solved:
    """Derive an inverse-kinematics function of a serial robot with all its solution slots."""
    asked = (*arguments, *(task_input.argument for task_input in inputs))
    q = tuple(
        joint.direction * value for joint, value in zip(robot.coordinates, values, strict=True)
    )
    unit = common_unit([joint.unit for joint in robot.coordinates])
    names = tuple(robot.moving[joint].name for joint in given)
    lengths = [e for e, joint in zip(values, robot.coordinates, strict=True) if joint.unit == "m"]
    residual = with_rounding(work.terms, residual, lengths)
    function = function_of(name, work, asked, q, unit, residual, identity, given)
    return Solved(function, work, names, inputs)


def function_of(
    name: str,
    work: Work,
    inputs: tuple[Argument, ...],
    q: tuple[sp.Expr, ...],
    unit: str,
    residual: sp.Expr,
    identity: str,
    given: Iterable[int] = (),
    loops: Sequence[sp.Expr] = (),
) -> SymbolicFunction:
    """Return the generated function of a task, with all its solution slots.

    The arguments ``q`` and ``residual`` are expressions in the branch signs. ``given`` contains the
    indices of coordinates that do not depend on the target ``inputs[0]``.

    ``loops`` contains the margins of the closed loops.
    """
    k = 2 ** len(work.signs)
    domain = "pose" if inputs[0].symbols == POSE_SYMBOLS else "task"
    role = Role("inverse", domain, fixed=tuple(sorted(given)), labels=_labels(work))
    outputs = (
        Result("q", q, (k, len(q)), unit, "joint coordinates, one solution per row"),
        Result("residual", (residual,), (k,), "m or rad", "distance of fk(q[k]) from the target"),
        Result(
            "margin",
            (margin_of(work, loops),),
            (k,),
            "1",
            "distance from the boundary of the reachable set, negative outside",
        ),
    )
    summary = f"All inverse kinematics solutions, in {k} solution slots."
    return SymbolicFunction(
        name, summary, identity, inputs, outputs, work.terms, signs=tuple(work.signs), role=role
    )


def _labels(work: Work) -> tuple[str, ...]:
    joints = {step.found.sign: "+".join(step.joints) for step in work.steps if step.found.sign}
    parts: list[str] = []
    for sign in work.signs:
        # If a solution step has two branch signs, the step stores the first sign symbol. The second
        # sign symbol is the next symbol in ``work.signs``.
        loop = work.sides[sign][0] if sign in work.sides else ""
        parts.append(loop or joints.get(sign) or (parts[-1] if parts else sign.name.lstrip("_")))
    return tuple(
        branch_label(
            [
                (part, _side(work, symbol, sign))
                for part, symbol, sign in zip(parts, work.signs, signs, strict=True)
            ]
        )
        for signs in product((1, -1), repeat=len(parts))
    )


def _side(work: Work, symbol: sp.Symbol, sign: int) -> str:
    return work.sides[symbol][1][sign] if symbol in work.sides else side_of(sign)
