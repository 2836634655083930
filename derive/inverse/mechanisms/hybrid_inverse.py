"""Inverse kinematics of a robot with loops.

The tool pose determines the joints of the main chain, and these joints determine the actuators. If
the loops prevent a part of the main chain from rotating, virtual prismatic joints replace this part
of the chain. The displacements of the virtual prismatic joints then determine the actuators of the
replaced part.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import combinations

import sympy as sp

from ...chain.kinematics import common_unit
from ...loops.closing.loop_model import loop_model
from ...loops.functions.tool import tool_kinematics
from ...loops.iterated.closure_equations import LoopClosure
from ...loops.solve.solution import near_reference
from ...loops.solve.solved_loops import SolvedLoops, named, solved_loops
from ...model.errors import DescriptionError
from ...model.tolerances import MIN_CONVERGED, NEARLY_STRUCTURE
from ...terms.symbolic_function import Argument, NativeSolverFunction
from ...terms.vectors import Basis, Vector
from ..chain_solution import solve_chain
from ..classify import Attempt, Classification, classify, of_lines, unfit
from ..families import FAMILIES
from ..families.family import Family
from ..nominal_mechanism import Nominal, convergence_of, nominal_mechanisms, turns_of
from ..polished_inverse import RefinedTables, as_start, refined_inverse
from ..serial_inverse import Inverses
from ..steps.target import of_pose
from ..steps.work import Work
from ..structure import rank
from ..structure.requirement import Requirement
from ..tasks.slots import (
    POSE_SYMBOLS,
    function_of,
    pose_argument,
    pose_residual,
    tool_of,
)
from ..tasks.task import Solved, TaskInput
from .chain_inverse import chain_inverse, moving_coordinates
from .loop_sides import (
    choices_of_loops,
    settled_choices,
    solved_on_sides,
    unused_sides,
)
from .moving_chain import MovingChain, moving_chain
from .starts_beyond import beyond_dead_points
from .substitution import substituted
from .translation import (
    Translating,
    actuators_of,
    of_position_alone,
    position_task,
    still_axes,
    translating,
)

MAX_TRIED = 60
"""Maximum number of sets of fixed joints to try if a fixed revolute joint is between free joints.
"""
IDENTITY = "fk(q[k]) = T if residual[k] is a rounding error"


def hybrid_inverses(
    hybrid: SolvedLoops,
    families: Sequence[Family] = FAMILIES,
    give: tuple[int, ...] = (),
    closure: LoopClosure | None = None,
) -> Inverses:
    """Derive the closed-form inverse kinematics of a robot with loops and a main chain.

    If the inverse kinematics of the built robot has no closed form, the solutions of the nominal
    robot are refined.

    Args:
        hybrid: The robot.
        families: The families of axis structures to try on the main chain, in order.
        give: Indices of the chain joints to fix, or () to select suitable joints automatically.
        closure: Closure equations of loops without a closed form, or None if all loops have a
            closed form. Loops without a closed form require a nominal robot.
    """
    if closure is not None:
        exact = Inverses(classify(hybrid.robot, hybrid.terms, len(hybrid.q), families, give), {})
    else:
        exact = _by_structure(hybrid, families, give)
    if exact.solved:
        return exact
    by_chain = partial(chain_inverse, hybrid, families, give)
    by_nominal = partial(_by_nominal, hybrid, families, give, closure)
    # For a redundant chain, the nominal robot is tried first, because this robot decides which
    # joints are fixed.
    is_redundant = len(hybrid.robot.moving) > rank.of_chain(exact.classification.lines)
    methods = (by_nominal, by_chain) if is_redundant else (by_chain, by_nominal)
    found = next(filter(None, (method() for method in methods)), None)
    return found or _without_nominal(hybrid, exact, give)


def _by_structure(
    hybrid: SolvedLoops,
    families: Sequence[Family],
    give: tuple[int, ...],
    built: SolvedLoops | None = None,
) -> Inverses:
    """Return the inverse kinematics of the main chain or of the chain with virtual joints.

    Args:
        hybrid: The robot.
        families: The families of inverse kinematics solutions to try.
        give: Indices of the chain joints to fix.
        built: The as-built robot if ``hybrid`` is its nominal robot, otherwise None. The loops of
            the built robot may need coordinates beyond a dead point of the nominal robot.
    """
    classification = classify(hybrid.robot, hybrid.terms, len(hybrid.q), families, give)
    if classification.found is None and not give:
        classification = _giving_turns(hybrid, classification, families) or classification
    if not {c.moves for c in hybrid.mechanism.coordinates}.isdisjoint(hybrid.backward.open):
        return Inverses(classification, {})
    if classification.found is not None:
        whole = MovingChain.of(hybrid.robot, classification.lines, classification.found)
        return Inverses(classification, {"ik": _by_chain(hybrid, whole, built)})
    moving = None if give or built is not None else moving_chain(hybrid, families)
    if moving is not None:
        chain, classification = moving
        return Inverses(classification, {"ik": _by_chain(hybrid, chain, None)})
    moved = None if give else translating(hybrid)
    if moved is None:
        return Inverses(classification, {})
    shorter = of_lines(moved.lines, families=families)
    is_start = built is not None
    solved_ = _by_translation(hybrid, moved, shorter.found, is_start) if shorter.found else None
    return Inverses(shorter, {} if solved_ is None else {"ik": solved_})


def _giving_turns(
    hybrid: SolvedLoops, classification: Classification, families: Sequence[Family]
) -> Classification | None:
    """Return a closed-form structure of a chain with fixed inner revolute joints, or None.

    For example, a long-arm excavator has four parallel axes on a column, and one of these four
    joints must be fixed.
    """
    lines, count = classification.lines, len(hybrid.robot.moving)
    surplus = count - rank.of_chain(lines)
    if surplus < 1 or len(hybrid.q) != count or unfit(hybrid.robot):
        return None
    choices = sorted(combinations(range(count), surplus), key=lambda give: give[::-1], reverse=True)
    tried = (of_lines(lines, count, families, give) for give in choices[:MAX_TRIED])
    found = next((each for each in tried if each.found is not None), None)
    return None if found is None else replace(found, give=())


def _by_nominal(
    hybrid: SolvedLoops,
    families: Sequence[Family],
    give: tuple[int, ...],
    closure: LoopClosure | None,
) -> Inverses | None:
    for nominal in nominal_mechanisms(hybrid.mechanism):
        try:
            found = _of_nominal(hybrid, nominal, families, give, closure)
        except DescriptionError:
            # The loops of the nominal mechanism cannot be closed at the reference configuration.
            if hybrid.mechanism.nominal is not None:
                raise
            continue
        if found is not None:
            return found
    return None


def _without_nominal(hybrid: SolvedLoops, exact: Inverses, give: tuple[int, ...]) -> Inverses:
    nominal, missing = hybrid.mechanism.nominal, exact.classification.missing
    attempts = exact.classification.attempts
    could_fit = any(one.deviation <= NEARLY_STRUCTURE for one in attempts)
    if nominal is not None:
        why = f"no inverse of the nominal robot {nominal.name!r} can be refined to this robot"
    elif (
        not give
        and hybrid.mechanism.is_constrained
        and missing
        and (could_fit or len(hybrid.theta) > len(hybrid.q))
    ):
        why = 'for a file of the robot as built, nominal = "<file>" must name the robot as designed'
    else:
        return exact
    missing = f"{missing}; {why}" if missing else why
    return replace(exact, classification=replace(exact.classification, missing=missing))


def _of_nominal(
    hybrid: SolvedLoops,
    nominal: Nominal,
    families: Sequence[Family],
    give: tuple[int, ...],
    closure: LoopClosure | None,
) -> Inverses | None:
    """Return the inverse kinematics that refines the solutions of a nominal robot.

    Return None if Newton's method recovers too few poses from the nominal solutions.
    """
    design = solved_loops(loop_model(nominal.mechanism, hybrid.terms))
    exact = _by_structure(design, families, give, hybrid) if not design.forward.open else None
    found = exact.classification.found if exact and exact.solved else None
    if exact is None or found is None:
        return None
    solved = exact.solved["ik"]
    if solved.inputs or (found.given and closure) or not _holds(hybrid, solved, found):
        return None
    axes = still_axes(design)
    if axes is not None:
        solved = replace(solved, function=of_position_alone(solved.function, axes))
    start, length = solved.function, exact.classification.lines.length or 1.0
    converge = partial(convergence_of, hybrid, start, length, found.given, closure)
    convergence = converge()
    if convergence.share < MIN_CONVERGED:
        return None
    missed = Requirement(
        "the loops have the lengths of the nominal robot", nominal.moved / length, is_length=True
    )
    nearly = replace(found, requirements=(*found.requirements, missed))
    tables = RefinedTables(turns_of(hybrid), length, convergence.deviation, is_searched=False)
    tasks: tuple[NativeSolverFunction, ...] = ()
    if axes is not None:
        near = replace(tables, deviation=converge(is_position=True).deviation)
        tasks = (position_task(refined_inverse(start, near)),)
    nominal_task = as_start(solved)
    return Inverses(
        replace(exact.classification, found=nearly, missing=""),
        {nominal_task.function.name: nominal_task},
        polished=refined_inverse(start, tables),
        polished_tasks=tasks,
    )


def _holds(hybrid: SolvedLoops, solved: Solved, found: Attempt) -> bool:
    given = {hybrid.theta[k] for k in found.given}
    fixed = (_actuator(hybrid, k) for k in solved.function.role.fixed)
    return all(_arguments(hybrid, entry) <= given for entry in fixed)


def _actuator(hybrid: SolvedLoops, k: int) -> sp.Expr:
    """Return the value of one actuator as a function of the main-chain joints.

    Raises:
        DescriptionError: The value of the actuator has no closed form in the main-chain joints.
    """
    coordinate = hybrid.mechanism.coordinates[k]
    if coordinate.moves in hybrid.backward.open:
        raise DescriptionError(f"{hybrid.mechanism.name}: no closed form for {coordinate.name}")
    (value,) = named(hybrid, hybrid.backward, [coordinate.moves])
    return hybrid.terms.let(value / coordinate.ratio)


def _by_chain(hybrid: SolvedLoops, chain: MovingChain, built: SolvedLoops | None) -> Solved:
    pose = _on_chain(hybrid, chain, Work(hybrid.terms))
    settled = settled_choices(hybrid, pose, chain.given)
    if built is not None and built.has_closed_form:
        settled -= choices_of_loops(pose.work)
        start = _on_chain(hybrid, chain, Work(hybrid.terms, settled=settled), built)
        settled |= unused_sides(built, start, chain.given)
    return _on_chain(hybrid, chain, Work(hybrid.terms, settled=settled), built)


def _on_chain(
    design: SolvedLoops, chain: MovingChain, work: Work, built: SolvedLoops | None = None
) -> Solved:
    """Solve for the chain joints, and then for the actuators.

    If ``built`` describes the robot as built, the solved coordinates are start values for Newton's
    method. The coordinates of fixed joints are computed with the geometry of the robot as built,
    because Newton's method does not change these coordinates.
    """
    terms = design.terms
    loops = built if built is not None and built.has_closed_form else design
    arguments, joints = chain.coordinates(work)
    joints = near_reference(design.mechanism, terms, design.robot.moving, joints)
    fixed = moving_coordinates(design, chain.given)
    solution = solved_on_sides(loops, work)
    entries = list(loops.actuators_in(solution))
    if built is not None:
        entries = list(beyond_dead_points(terms, entries))
    if built is not None and loops is design:
        for k in fixed:
            entries[k] = _actuator(built, k)
    margins = [margin for _, margin in solution.margins]
    values = substituted(terms, [*entries, *margins], dict(zip(loops.theta, joints, strict=True)))
    q, closing = values[: len(entries)], values[len(entries) :]
    # The loops of the built robot differ from the loops of the design, so only the tool pose of the
    # main chain is compared with the target.
    residual = _chain_residual(design, joints) if loops is built else _residual(design, q)
    if built is None:
        residual = _while_closed(design, residual, closing)
    names = tuple(loops.robot.moving[k].name for k in chain.given)
    inputs = chain.found.family.inputs
    return _solved(loops, work, arguments, inputs, q, residual, names, fixed, closing)


def _chain_residual(design: SolvedLoops, joints: Sequence[sp.Expr]) -> sp.Expr:
    moving = zip(design.robot.moving, joints, strict=True)
    turned = [joint.direction * coordinate for joint, coordinate in moving]
    pose = tool_of(design.terms, design.robot, turned)
    return pose_residual(design.terms, pose, POSE_SYMBOLS)


def _by_translation(
    hybrid: SolvedLoops, moved: Translating, found: Attempt, is_start: bool
) -> Solved | None:
    pose = _on_shorter_chain(hybrid, moved, found, Work(hybrid.terms))
    if pose is None:
        return None
    work = Work(hybrid.terms, settled=settled_choices(hybrid, pose))
    return _on_shorter_chain(hybrid, moved, found, work, is_start=is_start)


def _on_shorter_chain(
    hybrid: SolvedLoops, moved: Translating, found: Attempt, work: Work, *, is_start: bool = False
) -> Solved | None:
    robot, terms = hybrid.robot, hybrid.terms
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
    solution = solved_on_sides(hybrid, work)
    closing = [m for _, m in solution.margins if _arguments(hybrid, m) <= theta.keys()]
    actuators = hybrid.actuators_in(solution)
    if is_start:
        actuators = beyond_dead_points(terms, actuators)
    q = []
    for symbol, entry in zip(hybrid.q, actuators, strict=True):
        if symbol in sliding:
            q.append(sliding[symbol])
            continue
        needed = _arguments(hybrid, entry)
        if not needed <= theta.keys():
            return None
        q.append(substituted(terms, [entry], theta)[0])
    margins = list(substituted(terms, closing, theta))
    # The virtual prismatic joints do not affect whether the replaced loops close.
    residual = _residual(hybrid, q, is_closed=is_start)
    return _solved(hybrid, work, (), found.family.inputs, tuple(q), residual, closing=margins)


def _arguments(hybrid: SolvedLoops, entry: sp.Expr) -> set[sp.Symbol]:
    rests_on = [entry, *(hybrid.terms.definitions[s] for s in hybrid.terms.needed([entry]))]
    return {symbol for e in rests_on for symbol in e.free_symbols} & set(hybrid.theta)


def _solved(
    hybrid: SolvedLoops,
    work: Work,
    arguments: Sequence[Argument],
    inputs: tuple[TaskInput, ...],
    q: tuple[sp.Expr, ...],
    residual: sp.Expr,
    names: tuple[str, ...] = (),
    given: Sequence[int] = (),
    closing: Sequence[sp.Expr] = (),
) -> Solved:
    unit = common_unit([c.unit for c in hybrid.mechanism.coordinates])
    inputs_of_task = (pose_argument(hybrid.robot), *arguments, *(i.argument for i in inputs))
    function = function_of("ik", work, inputs_of_task, q, unit, residual, IDENTITY, given, closing)
    return Solved(function, work, names, inputs)


def _residual(hybrid: SolvedLoops, q: Sequence[sp.Expr], *, is_closed: bool = True) -> sp.Expr:
    terms = hybrid.terms
    axes, origin = tool_kinematics(hybrid).forward.tool_pose()
    entries: Sequence[sp.Expr] = (*axes[0], *axes[1], *axes[2], *origin)
    if not is_closed:
        entries = hybrid.while_closed(entries, hybrid.forward)
    values: Mapping[sp.Symbol, sp.Expr] = dict(zip(hybrid.q, q, strict=True))
    x, y, z, position = _triples(substituted(terms, entries, values))
    return pose_residual(terms, ((x, y, z), position), POSE_SYMBOLS)


def _while_closed(hybrid: SolvedLoops, residual: sp.Expr, closing: Sequence[sp.Expr]) -> sp.Expr:
    if not closing:
        return residual
    closed = sp.And(*(sp.Ge(margin, 0) for margin in closing))
    return hybrid.terms.let(residual + hybrid.where(closed))


def _triples(entries: Sequence[sp.Expr]) -> list[Vector]:
    return [(entries[k], entries[k + 1], entries[k + 2]) for k in range(0, len(entries), 3)]


def _matrix(home: tuple[Basis, Vector]) -> sp.Matrix:
    axes, origin = home
    T = sp.eye(4)
    for j, column in enumerate((*axes, origin)):
        T[:3, j] = sp.Matrix(column)
    return T
