"""The inverse kinematics of a serial robot: every task that its structure solves, as functions."""

from collections.abc import Mapping
from dataclasses import dataclass

import sympy as sp

from ..chain.kinematics import arguments_of
from ..model.robot import Robot
from ..terms.role import Role
from ..terms.symbolic_function import Argument, Result, SymbolicFunction, WrittenFunction
from ..terms.terms import Terms
from .families import planar, swivel, turntable
from .families import position as position_family
from .general import raghavan_roth, written_inverse
from .nominal import nominal_of
from .slots import POSE_SYMBOLS, Solved, of_pose_task
from .steps.target import Target, of_pose
from .steps.work import Work
from .structure.classify import Attempt, Classification, classify, of_lines
from .structure.lines import Lines, axes_of, home_of, with_tool_axis
from .structure.locks import without
from .subproblems.turns import Turn
from .tasks import planar_tasks, position, position_direction, target_of_direction, turntable_tasks

SWIVEL = sp.Symbol("_swivel", real=True)
_WITHOUT_TOOL_AXIS = 5
"""So many joints meet place and direction of the tool, if they are not what a turntable has."""


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
    def missing(self) -> str:
        """Why there is no inverse, in words; empty where there is one."""
        return "" if self.solved or self.written else self.classification.missing

    @property
    def functions(self) -> dict[str, SymbolicFunction]:
        """All functions by name."""
        tasks = {name: solved.function for name, solved in self.solved.items()}
        return tasks | {function.name: function for function in self.others}


def inverses(robot: Robot, terms: Terms, coordinates: int | None = None) -> Inverses:
    """The closed-form inverse of a serial robot, in all tasks that its structure solves.

    Args:
        robot: The description.
        terms: Names of all terms.
        coordinates: How many coordinates move it, where it is the main chain of a robot with loops.
    """
    classification = classify(robot, terms, coordinates)
    found = classification.found
    if found is None and len(classification.lines.axes) == _WITHOUT_TOOL_AXIS:
        return _with_tool_axis(robot, classification)
    if found is None:
        return _general(robot, classification)
    if classification.tier == "snapped":
        return _of_nominal(robot, classification, found)
    solved = {"ik": _of_pose(robot, classification.lines, found)}
    others: tuple[SymbolicFunction, ...] = ()
    as_described = not found.given and not found.backwards
    if found.family is turntable and as_described:
        solved |= turntable_tasks(robot, classification.lines)
    elif found.family is position_family:
        solved = {"ik_position": position(robot, classification.lines)}
    elif found.family is planar and as_described:
        solved |= planar_tasks(robot, classification.lines)
    elif found.family is swivel:
        others = (_swivel_of(robot, classification.lines),)
    return Inverses(classification, solved, others)


def _with_tool_axis(robot: Robot, classification: Classification) -> Inverses:
    """The inverse of five joints, as that of six of which the last would turn the tool.

    What it would turn about is the tool's own axis, so that place and direction of the tool do not
    tell of it; and a pose that the five can have leaves it at 0.
    """
    lines = with_tool_axis(robot, classification.lines)
    longer = of_lines(lines)
    if longer.found is None or longer.tier != "exact":
        return Inverses(classification, {})
    solved = {"ik": _of_pose(robot, lines, longer.found)}
    work = Work(lines.terms)
    target = target_of_direction(robot, lines.terms)
    solve_chain(work, lines, longer.found, target, {})
    solved["ik_position_direction"] = position_direction(robot, work)
    return Inverses(longer, solved)


def _of_nominal(robot: Robot, classification: Classification, found: Attempt) -> Inverses:
    """The inverse of the arm that a calibrated one was meant to be."""
    lines = classification.lines
    nominal = nominal_of(robot, lines, found)
    exact = Lines(lines.terms, axes_of(nominal, lines.terms))
    return Inverses(classification, {"ik": _of_pose(nominal, exact, found)})


def _general(robot: Robot, classification: Classification) -> Inverses:
    """The inverse of six revolute joints without a structure, where their equations have one."""
    split = raghavan_roth.split_of(robot)
    if split is None:
        return Inverses(classification, {})
    equations = raghavan_roth.matrices(robot, split, classification.lines.terms)
    return Inverses(classification, {}, (equations,), (written_inverse.inverse(robot, split),))


def _of_pose(robot: Robot, lines: Lines, found: Attempt) -> Solved:
    """All joints from the pose of the tool, and from the values of those that are given."""
    work = Work(lines.terms)
    units = [joint.unit for joint in robot.coordinates]
    symbols = arguments_of(units)["q"].symbols
    arguments = {k: given_argument(robot, k, symbols[k]) for k in found.given}
    given = {k: robot.moving[k].direction * symbols[k] for k in found.given}
    target = of_pose(lines.terms, POSE_SYMBOLS, home_of(robot, lines.terms))
    more = solve_chain(work, lines, found, target, given)
    return of_pose_task(robot, work, (*arguments.values(), *more), given)


def given_argument(robot: Robot, joint: int, symbol: sp.Symbol) -> Argument:
    """The input that gives the value of one joint."""
    moving = robot.moving[joint]
    meaning = f"the value of {moving.name}, which is given"
    return Argument(symbol.name.lstrip("_"), (symbol,), (), moving.unit, meaning)


def solve_chain(
    work: Work, lines: Lines, found: Attempt, target: Target, given: Mapping[int, sp.Expr]
) -> tuple[Argument, ...]:
    """Finds the joints of a chain by the structure that was found.

    Args:
        work: Receives the joints and the steps.
        lines: The chain.
        found: Its structure.
        target: What it is to do.
        given: Values of the joints that are given (radian or metre), by their places.

    Returns:
        What else the structure asks for.
    """
    lines, target = without(lines, target, given)
    if found.backwards:
        lines, target = lines.reversed(), target.reversed()
    if found.family is not swivel:
        found.family.solve(work, lines, target)
        return ()
    swivel.solve(work, lines, target, Turn(*work.terms.cos_sin(SWIVEL)))
    return (Argument("swivel", (SWIVEL,), (), "rad", "swivel angle of the elbow"),)


def _swivel_of(robot: Robot, lines: Lines) -> SymbolicFunction:
    """The swivel angle of a configuration, the second input of the inverse."""
    terms = lines.terms
    q = arguments_of([joint.unit for joint in robot.coordinates])["q"]
    turns = {
        k: Turn(*terms.cos_sin(joint.direction * symbol))
        for k, (joint, symbol) in enumerate(zip(robot.moving, q.symbols, strict=True))
    }
    turn = swivel.swivel_of(terms, lines, turns)
    angle = terms.let(sp.atan2(turn.s, turn.c, evaluate=False))
    result = Result("swivel", (angle,), (), "rad", "swivel angle of the elbow")
    return SymbolicFunction(
        "swivel",
        "Angle by which the elbow is turned about the line from shoulder to wrist.",
        "q is among the solutions of ik(fk(q), swivel(q))",
        (q,),
        (result,),
        terms,
        role=Role("redundancy", "actuators"),
    )
