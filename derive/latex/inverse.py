r"""The fragment of the inverse: its structure, its steps one after the other, and its slots."""

from collections.abc import Iterable, Mapping

import sympy as sp

from ..inverse.classify import Attempt, Classification
from ..inverse.explanation import NEVER, nearest
from ..inverse.explanation import listed as in_words
from ..inverse.found import FoundLength, Linear
from ..inverse.function import POSE_SYMBOLS
from .inverse_steps import PrintedStep, PrintedTask, printed_task
from .layout import Equation, aligned
from .names import escape
from .page import Page, listed, sentence, text
from .printer import FractionPrinter
from .tables import tabular

MINUS = "$-$"
MOST_MISSED = 3
"""Structures that are named where none holds."""


def inverse(page: Page) -> str:
    """The inverse as a derivation, or how far the axes are from one."""
    classification = page.inverse.classification
    if classification.found is None:
        return text(_missing(classification))
    tasks = list(printed_tasks(page).values())
    parts = [_structure(classification, classification.found), _method(tasks)]
    for task in tasks:
        parts += _task(page, task, titled=len(tasks) > 1)
    return text(*parts, _residual())


def printed_tasks(page: Page) -> Mapping[str, PrintedTask]:
    """All tasks in printed symbols, their steps counted on."""
    found: dict[str, PrintedTask] = {}
    first = 1
    notation, lines = page.equations.notation, page.inverse.classification.lines
    for name, solved in page.inverse.solved.items():
        found[name] = printed_task(page.robot, notation, lines, solved, first)
        first += len(found[name].steps)
    return found


def _missing(classification: Classification) -> str:
    """Which structures come near, and what they lack."""
    rows = nearest(classification)[:MOST_MISSED]
    if not rows:
        return f"There is no closed form: {escape(classification.missing)}."
    opening = "There is no closed form. Of the structures that have one, the nearest are"
    items = [rf"\item {escape(title)}: {_lacking(missed)}" for title, missed in rows]
    return "\n".join([opening, r"\begin{itemize}", *items, r"\end{itemize}"])


def _lacking(missed: Iterable[tuple[str, str]]) -> str:
    conditions = "; ".join(
        f"{what} ({off if off == NEVER else f'off by {off}'})" for what, off in missed
    )
    return f"it asks that {escape(conditions)}."


def _structure(classification: Classification, found: Attempt) -> str:
    """What the axes are like."""
    conditions = "; ".join(requirement.text for requirement in found.requirements)
    sentences = [rf"The structure is \emph{{{escape(found.title)}}}: {escape(conditions)}."]
    names = [escape(classification.lines.axes[k].name) for k in found.given]
    if names:
        more = "one joint more" if len(names) == 1 else f"{len(names)} joints more"
        verb = "is" if len(names) == 1 else "are"
        sentences.append(
            f"There {verb} {more} than a pose determines: {in_words(names)} {verb} given."
        )
    if found.backwards:
        sentences.append(
            "The chain is read from the tool, which is held: it has to bring the base to its place."
        )
    if classification.tier == "snapped":
        sentences.append(
            "The axes lie so but for small errors; the solutions of the arm without these start"
            " an iteration on the true one."
        )
    return " ".join(sentences)


def _method(tasks: Iterable[PrintedTask]) -> str:
    """What is common to all steps, said once."""
    equations = [step.step.found for task in tasks for step in task.steps]
    two = [found for found in equations if found.sign is not None]
    if not two:
        return ""
    return (
        r"A step with two solutions chooses by a sign. An equation $A \cos\theta + B \sin\theta"
        r" = C$ has them on either side of the angle of $(A, B)$; they meet where $C^2 = A^2 + B^2$."
        r" Beyond, where the margin $1 - C^2/(A^2 + B^2)$ is negative, the root counts as $0$,"
        r" which gives the least-squares answer. The margin of a solution is the smallest of its steps."
    )


def _task(page: Page, task: PrintedTask, *, titled: bool) -> Iterable[str]:
    """Given, steps, rest and slots of one task."""
    name = escape(task.solved.function.name)
    title = rf"\paragraph{{\texttt{{{name}}}.}} " if titled else ""
    yield sentence(f"{title}{_given(page, task)}", _vectors(page, task))
    for step in task.steps:
        yield sentence(_step(page, step), _speaking(task, step.number - task.steps[0].number + 1))
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
    """The vectors that the steps speak of and that rest on none."""
    printer = _printer(page)
    blocks = []
    for vector in task.vectors:
        if vector.called.after:
            continue
        letter, meaning = vector.letter, vector.called.meaning
        own = [d for d in task.definitions if d[0] in vector.shown]
        shared = [d for d in task.definitions if d not in own]
        if own:
            blocks.append(f"There, {escape(meaning)} is at ${letter}$, with")
            blocks.append(aligned(_equations(printer, [*shared, *own])))
        else:
            blocks.append(
                f"There, {escape(meaning)} is at $({', '.join(map(printer.tex, vector.shown))})$."
            )
    return sentence(*blocks)


def _speaking(task: PrintedTask, after: int) -> str:
    """What the following steps speak of by name."""
    own = [vector for vector in task.vectors if vector.called.after == after]
    what = [f"${vector.letter}$ is {escape(vector.called.meaning)}" for vector in own]
    return f"In what follows, {in_words(what)}." if what else ""


def _step(page: Page, printed: PrintedStep) -> str:
    printer, step = _printer(page), printed.step
    name = printer.tex(printed.name)
    what = f"${name}$"
    if printed.name != printed.unknown:
        what = f"${name} = {printer.tex(printed.unknown)}$"
    opening = rf"\textbf{{Step {printed.number}: {what}}}, {step.method}: {escape(step.reason)}."
    relation = _relation(printer, printed)
    shared = _equations(printer, printed.definitions)
    solution = aligned([(name, _signed([printer.tex(term) for term in printed.solution]))])
    blocks = [f"It solves ${relation}$," if relation else "It is"]
    if shared:
        blocks = [
            blocks[0] if relation else "",
            "with" if relation else "With",
            aligned(shared, end=","),
        ]
    blocks.append("so that" if relation else "it is" if shared else "")
    degenerate = f"Degenerate: {escape(step.degenerate)}." if step.degenerate else ""
    return sentence(opening, *blocks, solution, degenerate)


def _relation(printer: FractionPrinter, printed: PrintedStep) -> str:
    """The equation of a step with two solutions."""
    found, name = printed.step.found, printer.tex(printed.name)
    if isinstance(found, FoundLength):
        if len(printed.coefficients) == 2:  # noqa: PLR2004
            return ""
        _, linear, constant = printed.coefficients
        terms = [f"{name}^2", _times(printer, linear, name), printer.tex(constant)]
        return f"{' '.join(_signed([term for term in terms if term != '0']))} = 0"
    if not isinstance(found.equation, Linear):
        return ""
    a, b, d = printed.coefficients
    terms = [_times(printer, a, rf"\cos {name}"), _times(printer, b, rf"\sin {name}")]
    return f"{' '.join(_signed([term for term in terms if term != '0']))} = {printer.tex(d)}"


def _times(printer: FractionPrinter, factor: sp.Expr, what: str) -> str:
    if factor in (0, 1, -1):
        return {0: "0", 1: what, -1: f"-{what}"}[int(factor)]
    return f"{printer.tex(factor)} {what}"


def _signed(terms: list[str]) -> list[str]:
    """Terms of a sum, each but the first with its sign."""
    first, *rest = terms
    return [first, *(f"- {t[1:]}" if t.startswith("-") else f"+ {t}" for t in rest)]


def _equations(
    printer: FractionPrinter, definitions: Iterable[tuple[sp.Symbol, sp.Expr]]
) -> list[Equation]:
    return [(printer.tex(name), _terms(printer, value)) for name, value in definitions]


def _terms(printer: FractionPrinter, value: sp.Expr) -> list[str]:
    if not isinstance(value, sp.Piecewise):
        return printer.terms(value)
    (one, condition), (other, _) = value.args
    side = printer.tex(condition.lhs)
    return [rf"{printer.tex(one)} \text{{ if }} {side} \ge 0, \text{{ else }} {printer.tex(other)}"]


def _rest(page: Page, task: PrintedTask) -> str:
    """Coordinates without a step."""
    printer = _printer(page)
    parts = []
    if task.rest:
        parts.append(
            sentence("What is left of the sum is", aligned(_equations(printer, task.rest)))
        )
    if task.free:
        parts.append(f"The task leaves {listed(map(page.tex, task.free))} free, at $0$.")
    return sentence(*parts)


def _slots(page: Page, task: PrintedTask) -> str:
    """Which signs belong to which solution."""
    count = task.solved.function.branches
    if count == 1:
        return "There is one solution."
    printer = _printer(page)
    steps = {step.step.found.sign: step for step in task.steps}
    labels = [
        f"${printer.tex(shown)}$ (${printer.tex(steps[sign].name)}$)"
        for sign, shown in zip(task.solved.work.signs, task.signs, strict=True)
    ]
    columns = [("slot", labels)]
    for slot in range(count):
        bits = f"{slot:0{len(task.signs)}b}"
        columns.append((f"${slot}$", [MINUS if bit == "1" else "$+$" for bit in bits]))
    return sentence(
        f"There are at most ${count}$ solutions, in slots of these signs:", tabular(columns, 1)
    )


def _residual() -> str:
    return (
        "The residual of a solution is the larger of the distance (m) and the angle (rad) between"
        " the pose that forward kinematics gives for it and the one that is asked for; up to"
        " $10^{-9}$ the solution is valid. Every step builds on what earlier ones gave, in a"
        " degenerate case on what was taken there: angles found independently of each other would"
        " not fit together."
    )


def _printer(page: Page) -> FractionPrinter:
    notation = page.equations.notation
    return FractionPrinter(notation.tex, notation.order)
