"""The inverse kinematics of a robot with loops: first its main chain, then its actuators.

Where the main chain has a structure of its own, its joints follow from the pose, and the actuators
from the joints. Where loops keep part of the chain from turning, slides take its place, and the
actuators that move this part follow from the lengths of the slides.
"""

from collections.abc import Mapping, Sequence

import sympy as sp

from ..chain.kinematics import common_unit
from ..loops.hybrid import Hybrid
from ..terms.symbolic_function import Argument
from ..terms.vectors import Basis, Vector
from .chain_solution import given_argument, solve_chain
from .classify import Attempt, classify, of_lines
from .families import FAMILIES
from .families.family import Family
from .serial_inverse import Inverses
from .steps.target import of_pose
from .steps.work import Work
from .structure.lines import Lines, home_of
from .substitution import substituted
from .tasks.slots import POSE_SYMBOLS, function_of, pose_argument, pose_residual, values_of
from .tasks.task import Solved, TaskInput
from .translation import Translating, actuators_of, translating

IDENTITY = "fk(q[k]) = T wherever residual[k] is rounding"


def hybrid_inverses(
    hybrid: Hybrid, families: Sequence[Family] = FAMILIES, give: tuple[int, ...] = ()
) -> Inverses:
    """Derives the closed-form inverse of a robot with loops that has a main chain.

    Args:
        hybrid: The robot; its loops must be solved in closed form.
        families: The families to try on the main chain, in order.
        give: Indices of the chain's joints to be given; () for those that the structure needs.
    """
    classification = classify(hybrid.robot, hybrid.terms, len(hybrid.q), families, give)
    if classification.found is not None:
        solved = _by_chain(hybrid, classification.lines, classification.found)
        return Inverses(classification, {"ik": solved})
    moved = None if give else translating(hybrid)
    if moved is None:
        return Inverses(classification, {})
    shorter = of_lines(moved.lines, families=families)
    solved_ = _by_translation(hybrid, moved, shorter.found) if shorter.found else None
    return Inverses(shorter, {} if solved_ is None else {"ik": solved_})


def _by_chain(hybrid: Hybrid, lines: Lines, found: Attempt) -> Solved:
    """The joints of the main chain, then the actuators from them."""
    robot, terms = hybrid.robot, hybrid.terms
    work = Work(terms)
    symbols = {k: sp.Symbol(f"_{robot.moving[k].name}", real=True) for k in found.given}
    given = {k: robot.moving[k].direction * symbol for k, symbol in symbols.items()}
    arguments = tuple(given_argument(robot, k, symbol) for k, symbol in symbols.items())
    target = of_pose(terms, POSE_SYMBOLS, home_of(robot, terms))
    solve_chain(work, lines, found, target, given)
    joints = [
        joint.direction * value
        for joint, value in zip(robot.moving, values_of(work, robot, given), strict=True)
    ]
    theta = dict(zip(hybrid.theta, joints, strict=True))
    q = substituted(terms, hybrid.actuators, theta)
    names = tuple(robot.moving[k].name for k in found.given)
    held = _coordinates(hybrid, found.given)
    return _solved(hybrid, work, arguments, found.family.inputs, q, names, held)


def _by_translation(hybrid: Hybrid, moved: Translating, found: Attempt) -> Solved | None:
    """Turns and slides of the shorter chain, then the actuators from them."""
    robot, terms = hybrid.robot, hybrid.terms
    work = Work(terms)
    target = of_pose(terms, POSE_SYMBOLS, _matrix(moved.home))
    solve_chain(work, moved.lines, found, target, {})
    sliding = actuators_of(work, moved, hybrid.q)
    if sliding is None:
        return None
    theta = {
        symbol: joint.direction * terms.solved_angle(work.turns[k].c, work.turns[k].s)
        for k, (symbol, joint) in enumerate(zip(hybrid.theta, robot.moving, strict=True))
        if k in work.turns
    }
    q = []
    for symbol, entry in zip(hybrid.q, hybrid.actuators, strict=True):
        if symbol in sliding:
            q.append(sliding[symbol])
            continue
        needed = _arguments(hybrid, entry)
        if not needed <= theta.keys():
            return None
        q.append(substituted(terms, [entry], theta)[0])
    return _solved(hybrid, work, (), found.family.inputs, tuple(q), ())


def _arguments(hybrid: Hybrid, entry: sp.Expr) -> set[sp.Symbol]:
    """The joints of the main chain that a formula depends on."""
    rests_on = [entry, *(hybrid.terms.definitions[s] for s in hybrid.terms.needed([entry]))]
    return {symbol for e in rests_on for symbol in e.free_symbols} & set(hybrid.theta)


def _solved(
    hybrid: Hybrid,
    work: Work,
    arguments: Sequence[Argument],
    inputs: tuple[TaskInput, ...],
    q: tuple[sp.Expr, ...],
    names: tuple[str, ...],
    given: Sequence[int] = (),
) -> Solved:
    """The function; its residual compares the tool's pose at these actuated coordinates."""
    terms = hybrid.terms
    axes, origin = hybrid.kinematics.forward.tool_pose()
    entries = [e for vector in (*axes, origin) for e in vector]
    values: Mapping[sp.Symbol, sp.Expr] = dict(zip(hybrid.q, q, strict=True))
    x, y, z, position = _triples(substituted(terms, entries, values))
    residual = pose_residual(terms, ((x, y, z), position), POSE_SYMBOLS)
    unit = common_unit([c.unit for c in hybrid.mechanism.coordinates])
    asked = (pose_argument(hybrid.robot), *arguments, *(i.argument for i in inputs))
    function = function_of("ik", work, asked, q, unit, residual, IDENTITY, given)
    return Solved(function, work, names, inputs)


def _coordinates(hybrid: Hybrid, joints: Sequence[int]) -> list[int]:
    """The actuated coordinates, by index, that move joints of the main chain."""
    entries = [hybrid.chain[k] for k in joints]
    rests_on = [*entries, *(hybrid.terms.definitions[s] for s in hybrid.terms.needed(entries))]
    behind = {symbol for e in rests_on for symbol in e.free_symbols}
    return [k for k, symbol in enumerate(hybrid.q) if symbol in behind]


def _triples(entries: Sequence[sp.Expr]) -> list[Vector]:
    return [(entries[k], entries[k + 1], entries[k + 2]) for k in range(0, len(entries), 3)]


def _matrix(home: tuple[Basis, Vector]) -> sp.Matrix:
    """A pose of axes and origin as a homogeneous matrix."""
    axes, origin = home
    T = sp.eye(4)
    for j, column in enumerate((*axes, origin)):
        T[:3, j] = sp.Matrix(column)
    return T
