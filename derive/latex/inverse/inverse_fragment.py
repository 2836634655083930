r"""Prints the inverse kinematics."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import groupby

import sympy as sp

from ...inverse.mechanisms.backward_inverse import moving_inverses
from ...inverse.mechanisms.carried_wrist import PLATFORM, ROTATIONS, carried_wrist
from ...inverse.mechanisms.leg_chains import leg_chains
from ...inverse.mechanisms.mode_check import LEGS
from ...inverse.serial_inverse import Inverses
from ...inverse.structure.words import listed as in_words
from ...inverse.subproblems.equations import JointEquation
from ...inverse.tasks.slots import POSE_SYMBOLS
from ...loops.solve.solved_loops import SolvedLoops
from ...model.plural import counted
from ...terms.symbolic_function import NativeSolverFunction, SymbolicFunction
from ..chain.tables import tabular
from ..loops.loop_page import LoopPage
from ..setting.layout import aligned
from ..setting.names import escape
from ..setting.page import Page, listed, sentence, text
from ..setting.printer import FractionPrinter
from .general_fragment import general_arm
from .printed_equations import definitions, solved_step, solved_together
from .printed_task import PrintedInverseStep, PrintedTask, printed_task
from .structure_fragment import missing_structure, structure

MINUS = "$-$"


def inverse(page: Page) -> str:
    """Prints the solution steps.

    If there are none, the fragment states how far the axes are from a solvable structure.
    """
    return _written(page, page.inverse, {})


def inverse_of_loops(page: LoopPage) -> str:
    """Prints the inverse kinematics of the main chain."""
    chain = page.chain
    # The only task of a robot with loops is the complete pose.
    tasks = {name: solved for name, solved in chain.inverse.solved.items() if name == "ik"}
    of_chain = replace(chain.inverse, solved=tasks)
    found = page.inverse
    back = next((f for f in page.functions if f.name in ("ik", LEGS)), None)
    if back is not None and PLATFORM in back.inputs:
        return text(_rotations(page.hybrid), _through_the_chain(page, back))
    moving = moving_inverses(page.hybrid) if found is None and back is not None else None
    if moving is not None and back is not None:
        return text(_written(chain, moving, {}).rstrip(), _through_the_chain(page, back))
    if tasks and found is None and back is not None:
        return text(_written(chain, of_chain, {}).rstrip(), _through_the_chain(page, back))
    if tasks:
        return text(_written(chain, of_chain, {}).rstrip(), _sides_of_loops(found))
    if found is not None and found.composed is not None:
        return text(_written(chain, found, {}).rstrip(), _on_every_branch(found.composed))
    if found is None or not found.solved:
        return _written(chain, of_chain, {})
    if not _has_slides(chain, found):
        # If the arm itself has no closed form, the nominal arm is printed.
        return text(
            _written(chain, found, {}).rstrip(), _sides_of_loops(found), _position_task(found)
        )
    actuators = {q.name: shown for q, shown in zip(page.hybrid.q, page.q, strict=True)}
    return text(
        "Loops prevent part of the main chain from rotating, so that this part acts like"
        " prismatic joints; their displacements are found first.",
        _written(chain, found, actuators).rstrip(),
        "The actuators of the joints above follow from them as in the solution of the loops.",
        _position_task(found),
    )


def _rotations(hybrid: SolvedLoops) -> str:
    """Explains the rotations of a platform that carries a wrist."""
    carried = carried_wrist(hybrid)
    assert carried is not None
    names = [escape(joint.name) for joint in carried.wrist.moving]
    axes = f"The axes of {in_words(names)} meet" if names[1:] else f"The axis of {names[0]} passes"
    return (
        f"{axes} {'in' if names[1:] else 'through'} the wrist center $c$ of the platform, which the"
        " pose of the tool places at $w$. Each of three legs keeps a ball joint $b_i$ of the"
        " platform in a plane with the unit normal $n_i$ and the offset $d_i$. The rotation $R$ of"
        r" the platform therefore satisfies \[n_i\cdot R\,(b_i - c) = d_i - n_i\cdot w, \quad"
        r" i = 1, 2, 3.\] The first equation leaves two angles, and the other two equations are"
        " linear in the cosine and sine of the second angle. Their resultant is a trigonometric"
        f" polynomial of degree 4 in the first angle, with up to {ROTATIONS} real roots. The other"
        " joints of the main chain follow from the rotation."
    )


def _through_the_chain(page: LoopPage, function: SymbolicFunction) -> str:
    freedoms = page.hybrid.freedoms
    reached = (
        f" The tool has {counted(freedoms, 'degree')} of freedom: the residual of an unreachable"
        " pose is not zero."
        if freedoms < len(page.hybrid.theta)
        else ""
    )
    legs = [escape(leg.closure) for leg in leg_chains(page.hybrid) or ()]
    by_legs = (
        f" The legs that end at {in_words(legs)} are solved as serial arms whose last link has the"
        " pose of the closure's other frame."
        if legs
        else ""
    )
    count = function.branches * (ROTATIONS if PLATFORM in function.inputs else 1)
    slots = f"{count} slots" if count > 1 else "one slot"
    return (
        "The actuators follow from these joints as in the solution of the loops from the main"
        f" chain.{by_legs} Equivalent choices share a slot, so \\texttt{{ik}} has"
        f" {slots}; in each slot the loops close at the pose.{reached} A slot"
        " is a solution if \\texttt{fk} returns to the pose; its residual is infinite if the loops"
        " close there in another assembly mode."
    )


def _position_task(found: Inverses) -> str:
    if not found.polished_tasks:
        return ""
    names = in_words([rf"\texttt{{{escape(task.name)}}}" for task in found.polished_tasks])
    return (
        f"The nominal robot does not rotate its tool, and the true robot only slightly: {names}"
        " solves for the position only, from the same starts."
    )


def _has_slides(chain: Page, found: Inverses) -> bool:
    count = len(chain.robot.moving)
    return any(axis.joint >= count for axis in found.classification.lines.axes)


def _sides_of_loops(found: Inverses | None) -> str:
    solved = None if found is None else next(iter(found.solved.values()), None)
    if solved is None or not (solved.work.sides or solved.work.settled):
        return ""
    names = [name for name, _ in solved.work.sides.values()]
    sides = f" on both sides of {in_words([escape(name) for name in names])}" if names else ""
    return (
        f"The actuators follow from the joints as in the solution of the loops{sides}."
        " Equivalent choices share a slot, so the inverse of"
        f" the robot has {counted(solved.function.branches, 'slot')}."
    )


def _on_every_branch(function: NativeSolverFunction) -> str:
    chain, every, fk = (rf"\texttt{{{escape(name)}}}" for name in function.calls)
    return (
        f"The function {chain} solves the main chain. From each of its solutions, {every} computes"
        f" the actuators on every branch of the loops, and {fk} checks them: \\texttt{{ik}} has"
        f" {counted(function.branches, 'slot')}. The residual is infinite if the loops close at"
        " the pose in another assembly mode."
    )


def _written(page: Page, found: Inverses, actuators: Mapping[str, sp.Symbol]) -> str:
    classification = found.classification
    if found.general is not None:
        return text(
            missing_structure(classification), general_arm(page, found.general), _residual()
        )
    if classification.found is None or not found.solved:
        return text(missing_structure(classification))
    tasks = list(printed_tasks(page, found, actuators).values())
    parts = [structure(page, classification, classification.found), _method(tasks)]
    for task in tasks:
        earlier = tasks[0] if task is not tasks[0] else None
        parts += _task(page, task, earlier, titled=len(tasks) > 1)
    return text(*parts, _together_at_last(found), _residual())


def _together_at_last(found: Inverses) -> str:
    if not any(axis.stays for axis in found.classification.lines.axes):
        return ""
    return (
        "The pose has more conditions than the chain has joints, and the steps use as many as there"
        " are joints. If a solution nearly reaches the pose, one Gauss-Newton step"
        r" on all conditions, $(J^{\mathsf{T}} J + \mu I)\, \Delta q = J^{\mathsf{T}} e$ with the"
        r" twist $e$ to the pose and a small $\mu$, is used if it reduces the error."
    )


def printed_tasks(
    page: Page, inverses: Inverses, actuators: Mapping[str, sp.Symbol]
) -> Mapping[str, PrintedTask]:
    """Converts all tasks to printed symbols. The step numbers continue from task to task.

    Args:
        page: The symbols and expressions of the chain.
        inverses: Its inverse.
        actuators: Printed symbols of actuated coordinates, keyed by name. Solution steps may
            determine these coordinates.
    """
    found: dict[str, PrintedTask] = {}
    first = 1
    notation, lines = page.equations.notation, inverses.classification.lines
    for name, solved in inverses.solved.items():
        found[name] = printed_task(page.robot, notation, lines, solved, first, actuators)
        first += len(found[name].steps)
    return found


def _method(tasks: Iterable[PrintedTask]) -> str:
    methods = {step.step.method for task in tasks for step in task.steps}
    numbered = ""
    if any("subproblem" in method for method in methods):
        numbered = (
            "Subproblems are numbered as by Elias and Wen (2022); the subproblems of one rotation,"
            " of two rotations and of a rotation to a distance are Paden's (1986)."
        )
    equations = [step.step.found for task in tasks for step in task.steps]
    two = [found for found in equations if found.sign is not None]
    if not two:
        return numbered
    return sentence(
        numbered,
        r"In a step with two solutions, a sign selects one. An equation $A \cos\theta + B"
        r" \sin\theta = C$ has solutions on both sides of the angle of $(A, B)$; they meet if"
        r" $C^2 = A^2 + B^2$. If the margin $1 - C^2/(A^2 + B^2)$ is negative, the root"
        r" is set to $0$, which gives the least-squares answer. The margin of a solution is the"
        r" smallest margin of its steps.",
    )


def _task(
    page: Page, task: PrintedTask, earlier: PrintedTask | None, *, titled: bool
) -> Iterable[str]:
    name = escape(task.solved.function.name)
    title = rf"\paragraph{{\texttt{{{name}}}.}} " if titled else ""
    yield sentence(f"{title}{_given(page, task)}", _vectors(page, task))
    first = task.steps[0].number
    repeated = _repeated(page, task, earlier) if earlier else 0
    if repeated and earlier:
        yield _referred(page, task.steps[:repeated], earlier.steps[0].number)
    for group in [*_groups(task)][repeated:]:
        if isinstance(group[0].equation, JointEquation):
            yield _together(page, group)
        else:
            written = (_step(page, step) for step in group)
            yield sentence(*written, _speaking(page, task, group[-1].number - first + 1))
    yield sentence(_rest(page, task), _slots(page, task))


def _given(page: Page, task: PrintedTask) -> str:
    parts = []
    for argument, symbols in task.inputs:
        shown = listed(map(page.tex, symbols))
        if argument.symbols == POSE_SYMBOLS:
            first, *_, last = map(page.tex, symbols)
            parts.append(rf"the pose ${page.pose}$ with its entries ${first}, \dots, {last}$")
        elif set(symbols) <= set(page.equations.notation.q):
            parts.append(shown)
        else:
            parts.append(f"{shown} ({escape(argument.meaning)})")
    return f"Given {'are' if len(parts) > 1 else 'is'} {in_words(parts)}."


def _vectors(page: Page, task: PrintedTask) -> str:
    printer = _printer(page)
    blocks = []
    for vector in task.vectors:
        if vector.vector.after:
            continue
        letter, meaning = vector.letter, vector.vector.meaning
        own = [d for d in task.definitions if d[0] in vector.shown]
        shared = [d for d in task.definitions if d not in own]
        if own:
            blocks.append(f"Then {page.words(meaning)} is at ${letter}$, with")
            blocks.append(aligned(definitions(printer, [*shared, *own])))
        else:
            blocks.append(
                f"Then {page.words(meaning)} is at $({', '.join(map(printer.tex, vector.shown))})$."
            )
    return sentence(*blocks)


def _speaking(page: Page, task: PrintedTask, after: int) -> str:
    own = [vector for vector in task.vectors if vector.vector.after == after]
    clauses = [f"${vector.letter}$ is {page.words(vector.vector.meaning)}" for vector in own]
    return f"In what follows, {in_words(clauses)}." if clauses else ""


def _step(page: Page, printed: PrintedInverseStep) -> str:
    printer, step = _printer(page), printed.step
    name = printer.tex(printed.name)
    unknown = f"${name}$"
    if printed.name != printed.unknown:
        unknown = f"${name} = {printer.tex(printed.unknown)}$"
    opening = (
        rf"\textbf{{Step {printed.number}: {unknown}}}, {step.method}: {page.words(step.reason)}."
    )
    degenerate = f"Degenerate: {page.words(step.degenerate)}." if step.degenerate else ""
    return sentence(opening, solved_step(printed, printer), degenerate)


def _repeated(page: Page, task: PrintedTask, earlier: PrintedTask) -> int:
    """Returns the number of first steps that repeat an earlier task.

    The number is 0 if a later step uses a term from a repeated step.
    """
    own, other = _anonymous(page, task), _anonymous(page, earlier)
    same = [a == b for a, b in zip(own, other, strict=False)]
    count = next((k for k, equal in enumerate(same) if not equal), len(same))
    defined = {symbol for step in task.steps[:count] for symbol, _ in step.definitions}
    rest = [*task.steps[count:]]
    used = {s for step in rest for e in step.solution for s in e.free_symbols}
    used |= {s for step in rest for _, value in step.definitions for s in value.free_symbols}
    return 0 if defined & used else count


def _anonymous(page: Page, task: PrintedTask) -> list[str]:
    texts, names = [], []
    for group in _groups(task):
        if len(group) > 1 or isinstance(group[0].equation, JointEquation):
            break
        (step,) = group
        names += [page.tex(symbol) for symbol, _ in step.definitions]
        shown = _step(page, step).replace(f"Step {step.number}:", "", 1)
        for k, name in enumerate(names):
            shown = shown.replace(name, f"@{k}")
        texts.append(shown)
    return texts


def _referred(page: Page, steps: Sequence[PrintedInverseStep], first: int) -> str:
    names = in_words([f"${page.tex(step.unknown)}$" for step in steps])
    own = _numbers(steps[0].number, len(steps))
    return rf"\textbf{{{own}:}} {names} as in {_numbers(first, len(steps)).lower()}."


def _numbers(first: int, count: int) -> str:
    last = first + count - 1
    if count == 1:
        return f"Step {first}"
    return f"Steps {first} {'and' if count == 2 else 'to'} {last}"  # noqa: PLR2004


def _groups(task: PrintedTask) -> Iterable[list[PrintedInverseStep]]:
    for _, run in groupby(task.steps, key=lambda step: id(step.step.found.equation)):
        yield list(run)


def _together(page: Page, steps: list[PrintedInverseStep]) -> str:
    printer, (first, *_, last) = _printer(page), steps
    names = listed(printer.tex(step.name) for step in steps)
    opening = (
        rf"\textbf{{Steps {first.number} to {last.number}: {names}}}, {first.step.method}:"
        f" {page.words(first.step.reason)}."
    )
    return sentence(opening, solved_together(steps, printer))


def _rest(page: Page, task: PrintedTask) -> str:
    printer = _printer(page)
    parts = []
    if task.rest:
        parts.append(sentence("From the sum follows", aligned(definitions(printer, task.rest))))
    if task.free:
        parts.append(
            f"The task does not determine {listed(map(page.tex, task.free))}, which is set to $0$."
        )
    if task.locked:
        parts.append(f"The loops lock {listed(map(page.tex, task.locked))}.")
    return sentence(*parts)


def _slots(page: Page, task: PrintedTask) -> str:
    count = task.solved.function.branches
    if count == 1:
        return "There is one solution."
    printer = _printer(page)
    steps = {step.step.found.sign: step for step in task.steps}
    labels = []
    for sign, shown in zip(task.solved.work.signs, task.signs, strict=True):
        of_step = f" (${printer.tex(steps[sign].name)}$)" if sign in steps else ""
        labels.append(f"${printer.tex(shown)}${of_step}")
    columns = [("slot", labels)]
    for slot in range(count):
        bits = f"{slot:0{len(task.signs)}b}"
        columns.append((f"${slot}$", [MINUS if bit == "1" else "$+$" for bit in bits]))
    return sentence(
        f"There are at most ${count}$ solutions, in slots of these signs:", tabular(columns, 1)
    )


def _residual() -> str:
    return (
        "The residual of a solution is the larger of the distance (m) and $2 \\sin(\\alpha / 2)$,"
        " with the angle $\\alpha$ between the pose by forward kinematics and the target pose; a"
        " residual up to $10^{-9}$ is valid. Every step uses the results of earlier steps, in a"
        " degenerate case the value chosen there: independently computed angles would not be"
        " consistent."
    )


def _printer(page: Page) -> FractionPrinter:
    notation = page.equations.notation
    return FractionPrinter.of(notation)
