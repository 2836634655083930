"""The inverse kinematics of a serial robot: every task that its structure solves, as functions."""

from dataclasses import dataclass

import sympy as sp

from ..function import Argument, Result, SymbolicFunction, WrittenFunction
from ..kinematics import arguments_of
from ..poe import to_poe
from ..robot import Robot
from ..scope import Scope
from . import general_code, raghavan_roth
from .classify import Attempt, Classification, classify
from .families import planar, swivel, turntable
from .function import POSE_SYMBOLS, Solved, of_pose_task
from .lines import Lines
from .locks import without
from .target import of_pose
from .tasks import planar_tasks, turntable_tasks
from .turns import Turn
from .work import Work

SWIVEL = sp.Symbol("_swivel", real=True)


@dataclass(frozen=True)
class Inverses:
    """All that is known of a robot's inverse.

    Attributes:
        classification: Its structure, or why there is none.
        solved: The tasks by the names of their functions.
        others: Functions that belong to them: the swivel angle of a configuration,
            the equations of an arm without structure.
        written: The inverse of such an arm, which takes the eigenvalues of a matrix.
    """

    classification: Classification
    solved: dict[str, Solved]
    others: tuple[SymbolicFunction, ...] = ()
    written: tuple[WrittenFunction, ...] = ()

    @property
    def functions(self) -> dict[str, SymbolicFunction]:
        """All functions by name."""
        tasks = {name: solved.function for name, solved in self.solved.items()}
        return tasks | {function.name: function for function in self.others}


def inverses(robot: Robot, scope: Scope) -> Inverses:
    """The closed-form inverse of a serial robot, in all tasks that its structure solves.

    Args:
        robot: The description.
        scope: Names of all terms.
    """
    classification = classify(robot, scope)
    found = classification.found
    if found is None:
        return _general(robot, classification)
    solved = {"ik": _of_pose(robot, classification.lines, found)}
    others: tuple[SymbolicFunction, ...] = ()
    if found.family is turntable:
        solved |= turntable_tasks(robot, classification.lines)
    elif found.family is planar:
        solved |= planar_tasks(robot, classification.lines)
    elif found.family is swivel:
        others = (_swivel_of(robot, classification.lines),)
    return Inverses(classification, solved, others)


def _general(robot: Robot, classification: Classification) -> Inverses:
    """The inverse of six revolute joints without a structure, where their equations have one."""
    split = raghavan_roth.split_of(robot)
    if split is None:
        return Inverses(classification, {})
    equations = raghavan_roth.matrices(robot, split, classification.lines.scope)
    return Inverses(classification, {}, (equations,), (general_code.inverse(robot, split),))


def _of_pose(robot: Robot, lines: Lines, found: Attempt) -> Solved:
    """All joints from the pose of the tool, and from the values of those that are given."""
    scope = lines.scope
    work = Work(scope)
    inputs = []
    given = {}
    for k in found.given:
        joint = robot.moving[k]
        symbol = arguments_of([j.unit for j in robot.coordinates])["q"].symbols[k]
        given[k] = joint.direction * symbol
        meaning = f"the value of {joint.name}, which is given"
        inputs.append(Argument(symbol.name, (symbol,), (), joint.unit, meaning))
    target = of_pose(scope, POSE_SYMBOLS, to_poe(robot)[1])
    lines, target = without(lines, target, given)
    if found.backwards:
        lines, target = lines.reversed(), target.reversed()
    if found.family is swivel:
        inputs.append(Argument("swivel", (SWIVEL,), (), "rad", "swivel angle of the elbow"))
        found.family.solve(work, lines, target, Turn(*scope.cos_sin(SWIVEL)))
    else:
        found.family.solve(work, lines, target)
    return of_pose_task(robot, work, tuple(inputs), given)


def _swivel_of(robot: Robot, lines: Lines) -> SymbolicFunction:
    """The swivel angle of a configuration, the second input of the inverse."""
    scope = lines.scope
    q = arguments_of([joint.unit for joint in robot.coordinates])["q"]
    turns = {
        k: Turn(*scope.cos_sin(joint.direction * symbol))
        for k, (joint, symbol) in enumerate(zip(robot.moving, q.symbols, strict=True))
    }
    turn = swivel.swivel_of(scope, lines, turns)
    angle = scope.let(sp.atan2(turn.s, turn.c, evaluate=False))
    result = Result("swivel", (angle,), (), "rad", "swivel angle of the elbow")
    return SymbolicFunction(
        "swivel",
        "Angle by which the elbow is turned about the line from shoulder to wrist.",
        "q is among the solutions of ik(fk(q), swivel(q))",
        (q,),
        (result,),
        scope,
    )
