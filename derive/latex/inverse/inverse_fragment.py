r"""Prints the inverse kinematics of a chain."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import groupby

import sympy as sp

from ...inverse.serial_inverse import Inverses
from ...inverse.structure.words import listed as in_words
from ...inverse.subproblems.equations import JointEquation
from ...inverse.tasks.slots import POSE_SYMBOLS
from ..chain.tables import tabular
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
    """Print the solution steps of the inverse kinematics.

    If the arm has no solution steps, the fragment states how far the axes are from a solvable
    structure.
    """
    return written(page, page.inverse, {})


def written(page: Page, found: Inverses, actuators: Mapping[str, sp.Symbol]) -> str:
    """Print the axis structure and the solution steps of all inverse kinematics tasks.

    Args:
        page: The symbols of the chain.
        found: The inverse kinematics of the chain.
        actuators: Printed symbols of actuated coordinates, keyed by coordinate name.
    """
    classification = found.classification
    if found.general is not None:
        return text(
            missing_structure(classification), general_arm(page, found.general), _residual()
        )
    if classification.found is None or not found.solved:
        return text(missing_structure(classification))
    tasks = list(printed_tasks(page, found, actuators).values())
    parts = [structure(page, classification, classification.found), method(tasks)]
    for task in tasks:
        earlier = tasks[0] if task is not tasks[0] else None
        parts += _task(page, task, earlier, titled=len(tasks) > 1)
    return text(*parts, _together_at_last(found), _residual())


def _together_at_last(found: Inverses) -> str:
    if not any(axis.stays for axis in found.classification.lines.axes):
        return ""
    return (
        "The pose has more conditions than the chain has joints. The steps use one condition per"
        " joint. If a solution nearly reaches the pose, one Gauss-Newton step"
        r" on all conditions, $(J^{\mathsf{T}} J + \mu I)\, \Delta q = J^{\mathsf{T}} e$ with the"
        r" twist $e$ to the pose and a small $\mu$, is used if it reduces the error."
    )


def printed_tasks(
    page: Page, inverses: Inverses, actuators: Mapping[str, sp.Symbol]
) -> Mapping[str, PrintedTask]:
    """Convert the inverse kinematics of all tasks to the symbols that the LaTeX article prints.

    The solution steps are numbered consecutively across the tasks.

    Args:
        page: The symbols and expressions of the chain.
        inverses: The inverse kinematics of the chain.
        actuators: Printed symbols of the actuated coordinates that solution steps may determine,
            keyed by coordinate name.
    """
    found: dict[str, PrintedTask] = {}
    first = 1
    notation, lines = page.equations.notation, inverses.classification.lines
    for name, solved in inverses.solved.items():
        found[name] = printed_task(page.robot, notation, lines, solved, first, actuators)
        first += len(found[name].steps)
    return found


def method(tasks: Iterable[PrintedTask]) -> str:
    """Explain how subproblems are numbered and how steps with two solutions are solved."""
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
        r" \sin\theta = C$ has two solutions, symmetric about the angle of $(A, B)$; they coincide"
        r" if $C^2 = A^2 + B^2$. If the margin $1 - C^2/(A^2 + B^2)$ is negative, the root"
        r" is set to $0$, which gives the least-squares answer. The margin of a solution is the"
        r" smallest margin of its steps.",
    )


def _task(
    page: Page, task: PrintedTask, earlier: PrintedTask | None, *, titled: bool
) -> Iterable[str]:
    name = escape(task.solved.function.name)
    title = rf"\paragraph{{\texttt{{{name}}}.}} " if titled else ""
    yield sentence(f"{title}{_given(page, task)}", _vectors(page, task))
    repeated = _repeated(page, task, earlier) if earlier else 0
    if repeated and earlier:
        yield _referred(page, task.steps[:repeated], earlier.steps[0].number)
    yield from _steps(page, task, repeated)
    yield sentence(_rest(page, task), _slots(page, task))


def _steps(page: Page, task: PrintedTask, repeated: int = 0) -> Iterable[str]:
    first = task.steps[0].number
    for group in [*_groups(task)][repeated:]:
        if isinstance(group[0].equation, JointEquation):
            yield _together(page, group)
        else:
            written = (_step(page, step) for step in group)
            yield sentence(*written, _speaking(page, task, group[-1].number - first + 1))


def arm_steps(page: Page, inverses: Inverses, first: int) -> tuple[str, PrintedTask]:
    """Return the text of the solution steps of an arm in a loop, and the steps themselves.

    Args:
        page: The symbols of the arm.
        inverses: The inverse kinematics of the arm, with ``ik`` as its only task.
        first: Number of the first solution step.
    """
    classification = inverses.classification
    found = classification.found
    notation, solved = page.equations.notation, inverses.solved["ik"]
    task = printed_task(page.robot, notation, classification.lines, solved, first, {})
    return text(
        "" if found is None else structure(page, classification, found),
        sentence(_given(page, task), _vectors(page, task)),
        *_steps(page, task),
        _rest(page, task),
    ).rstrip(), task


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
    """Return the number of initial steps that a task has in common with an earlier task.

    If a later step of the task uses a term that the common steps define, the returned number is 0.
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
    own = step_numbers(steps[0].number, len(steps))
    return rf"\textbf{{{own}:}} {names} as in {step_numbers(first, len(steps)).lower()}."


def step_numbers(first: int, count: int) -> str:
    """Name consecutive steps."""
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
        parts.append(
            sentence("The sum of the angles gives", aligned(definitions(printer, task.rest)))
        )
    if task.free:
        parts.append(
            f"The task does not determine {listed(map(page.tex, task.free))}, which is set to $0$."
        )
    if task.locked:
        parts.append(f"The loops keep {listed(map(page.tex, task.locked))} constant.")
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
        f"There are at most ${count}$ solutions, in slots with these signs:", tabular(columns, 1)
    )


def _residual() -> str:
    return (
        "The residual of a solution is the larger of the distance (m) and $2 \\sin(\\alpha / 2)$,"
        " with the angle $\\alpha$ between the pose by forward kinematics and the target pose; a"
        " residual up to $10^{-9}$ is valid. Each step uses the results of earlier steps. If an"
        " earlier step is degenerate, later steps use the value that this step sets."
    )


def _printer(page: Page) -> FractionPrinter:
    notation = page.equations.notation
    return FractionPrinter.of(notation)
