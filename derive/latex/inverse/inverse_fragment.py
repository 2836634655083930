r"""The fragment of the inverse: its structure, its steps one after the other, and its slots."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from itertools import groupby

import sympy as sp

from ...inverse.classify import Attempt, Classification
from ...inverse.explanation import NEVER, nearest
from ...inverse.explanation import listed as in_words
from ...inverse.general.general_inverse import GeneralInverse
from ...inverse.hybrid_inverse import hybrid_inverses
from ...inverse.serial_inverse import Inverses
from ...inverse.subproblems.found import FoundLength, Linear, Simultaneous
from ...inverse.tasks.slots import POSE_SYMBOLS
from ..chain.tables import tabular
from ..loops.loop_page import LoopPage
from ..setting.layout import Equation, aligned
from ..setting.names import escape
from ..setting.page import Page, listed, sentence, text
from ..setting.printer import FractionPrinter
from .printed_inverse import PrintedInverseStep, PrintedTask, printed_task

MINUS = "$-$"
MOST_MISSED = 3
"""Structures that are named where none holds."""


def inverse(page: Page) -> str:
    """The inverse as a derivation, or how far the axes are from one."""
    return _written(page, page.inverse, {})


def inverse_of_loops(page: LoopPage) -> str:
    """That of the main chain, or of what loops keep from turning in it."""
    chain = page.chain
    # Of the tasks, a robot with loops offers the whole pose alone.
    tasks = {name: solved for name, solved in chain.inverse.solved.items() if name == "ik"}
    of_chain = replace(chain.inverse, solved=tasks)
    if tasks:
        return _written(chain, of_chain, {})
    found = hybrid_inverses(page.hybrid, chain.families)
    if not found.solved:
        return _written(chain, of_chain, {})
    actuators = {q.name: shown for q, shown in zip(page.hybrid.q, page.q, strict=True)}
    return text(
        "Where loops keep part of the main chain from turning, that part slides the rest; what it"
        " slides by is found first.",
        _written(chain, found, actuators).rstrip(),
        "What actuates the joints above follows from them as in the solution of the loops.",
    )


def _written(page: Page, found: Inverses, actuators: Mapping[str, sp.Symbol]) -> str:
    classification = found.classification
    if found.general is not None:
        return text(_missing(classification), _general(page, found.general), _residual())
    if classification.found is None or not found.solved:
        return text(_missing(classification))
    tasks = list(printed_tasks(page, found, actuators).values())
    parts = [_structure(classification, classification.found), _method(tasks)]
    for task in tasks:
        parts += _task(page, task, titled=len(tasks) > 1)
    return text(*parts, _residual())


def printed_tasks(
    page: Page, inverses: Inverses, actuators: Mapping[str, sp.Symbol]
) -> Mapping[str, PrintedTask]:
    """All tasks in printed symbols, their steps counted on.

    Args:
        page: The chain's page.
        inverses: Its inverse.
        actuators: Printed symbols of actuated coordinates that steps may find, by name.
    """
    found: dict[str, PrintedTask] = {}
    first = 1
    notation, lines = page.equations.notation, inverses.classification.lines
    for name, solved in inverses.solved.items():
        found[name] = printed_task(page.robot, notation, lines, solved, first, actuators)
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


def _general(page: Page, general: GeneralInverse) -> str:
    """The equations of an arm of six revolute joints without a structure."""
    split, count = general.split, general.function.branches
    q = [page.tex(page.equations.notation.q[k]) for k in split.joints]
    turns = [rf"R({tex})" for tex in q]
    walked = "from the base to the tool" if split.sense > 0 else "from the tool to the base"
    loop = r"\, ".join(rf"{turn}\, C_{{{k}}}" for k, turn in enumerate(turns, 1))
    left = rf"{turns[2]}\, C_3\, {turns[3]}\, C_4\, {turns[4]}\, C_5\, \ell"
    right = rf"C_2^{{-1}} {turns[1]}^{{-1}} C_1^{{-1}} {turns[0]}^{{-1}} C_6^{{-1}} \ell"
    return sentence(
        "Its six revolute joints are solved as those of a general arm (Raghavan and Roth; Manocha"
        r" and Canny). With $R(\theta)$ the turn by $\theta$ about $z$, counted backwards where the"
        " loop is walked against the joint, and $C_{i}$ the placements between the joints, one of"
        f" which holds the pose, the loop of arm and tool, walked {walked}, is",
        _centred(f"{loop} = I."),
        rf"The axis $\ell$ of the last of these joints does not depend on ${q[5]}$:",
        _centred(f"{left} = {right}."),
        r"Its direction $l$ and a point $p$ of it give fourteen quantities, $p$, $l$, $p \cdot p$,"
        r" $p \cdot l$, $p \times l$ and $(p \cdot p)\, l - 2 (p \cdot l)\, p$, that are linear in"
        rf" the products $x$ of cosines and sines of ${q[3]}$ and ${q[4]}$ on the left and in the"
        rf" eight products $y$ of those of ${q[0]}$ and ${q[1]}$ on the right:"
        rf" $A y = B({q[2]})\, x$. Six combinations are free of $y$. Times cosine and sine of"
        rf" ${q[3]}/2$ they are twelve equations $M({q[2]})\, u = 0$ in as many unknowns; $\det M$"
        rf" is a trigonometric polynomial of degree 8 in ${q[2]}$, whose {count} roots are the"
        rf" eigenvalues of a matrix. For a real root, $u$ gives ${q[3]}$ and ${q[4]}$, then $y$"
        rf" gives ${q[0]}$ and ${q[1]}$, and the loop gives ${q[5]}$. Newton's steps on the pose"
        rf" end it. There are at most {count} solutions.",
    )


def _centred(formula: str) -> str:
    return f"\\begin{{equation*}}\n{formula}\n\\end{{equation*}}%"


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
        r" = C$ has them on either side of the angle of $(A, B)$; they meet where"
        r" $C^2 = A^2 + B^2$. Beyond, where the margin $1 - C^2/(A^2 + B^2)$ is negative, the root"
        r" counts as $0$, which gives the least-squares answer. The margin of a solution is the"
        r" smallest of its steps."
    )


def _task(page: Page, task: PrintedTask, *, titled: bool) -> Iterable[str]:
    """Given, steps, rest and slots of one task."""
    name = escape(task.solved.function.name)
    title = rf"\paragraph{{\texttt{{{name}}}.}} " if titled else ""
    yield sentence(f"{title}{_given(page, task)}", _vectors(page, task))
    first = task.steps[0].number
    for group in _groups(task):
        equation = _equation(group[0])
        if isinstance(equation, Simultaneous):
            yield _together(page, group, equation)
        else:
            written = (_step(page, step) for step in group)
            yield sentence(*written, _speaking(task, group[-1].number - first + 1))
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


def _step(page: Page, printed: PrintedInverseStep) -> str:
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


def _equation(printed: PrintedInverseStep) -> object:
    found = printed.step.found
    return None if isinstance(found, FoundLength) else found.equation


def _groups(task: PrintedTask) -> Iterable[list[PrintedInverseStep]]:
    """The steps, those that solve one equation together."""
    for _, run in groupby(task.steps, key=lambda step: id(_equation(step) or step)):
        yield list(run)


def _together(page: Page, steps: list[PrintedInverseStep], equation: Simultaneous) -> str:
    """Several unknowns of one equation, which a quartic solves."""
    printer, (first, *_, last) = _printer(page), steps
    names = listed(printer.tex(step.name) for step in steps)
    opening = (
        rf"\textbf{{Steps {first.number} to {last.number}: {names}}}, {first.step.method}:"
        f" {escape(first.step.reason)}."
    )
    shared = _equations(printer, first.definitions)
    blocks = ["With", aligned(shared)] if shared else []
    written = _loop_of_three if equation.number == 5 else _two_ellipses  # noqa: PLR2004
    return sentence(opening, *blocks, *written(printer, steps))


def _loop_of_three(printer: FractionPrinter, steps: list[PrintedInverseStep]) -> Iterable[str]:
    """Subproblem 5."""
    one, two, three = (_turning(printer, step) for step in steps)
    p = [rf"\vec{{p}}_{{{k}}}" for k in range(4)]
    R = [rf"R(\vec{{k}}_{{{k}}}, {angle})" for k, angle in enumerate((one, two, three), 1)]
    yield rf"They solve ${p[0]} + {R[0]} {p[1]} = {R[1]} \bigl({p[2]} + {R[2]} {p[3]}\bigr)$ with"
    coefficients = steps[0].coefficients
    names = ("p_{0}", "k_{1}", "p_{1}", "k_{2}", "p_{2}", "k_{3}", "p_{3}")
    rows = []
    for k, name in enumerate(names):
        x, y, z = map(printer.tex, coefficients[3 * k : 3 * k + 3])
        rows.append((rf"\vec{{{name[0]}}}{name[1:]}", [f"({x},", f"{y},", f"{z})"]))
    yield aligned(rows)
    yield (
        rf"The turn by ${two}$ changes neither the length of what it turns nor its part along"
        rf" $\vec{{k}}_{{2}}$: two equations that are linear in the cosines and sines of ${one}$"
        rf" and ${three}$, a quartic with up to four real roots. Then ${two}$ turns one side to the"
        " other."
    )


def _two_ellipses(printer: FractionPrinter, steps: list[PrintedInverseStep]) -> Iterable[str]:
    """Subproblem 6."""
    yield "They solve"
    one, two = (step.sense * step.name for step in steps)
    a = steps[0].coefficients
    rows = []
    for k in range(2):
        left = a[2 * k] * sp.sin(one) + a[2 * k + 1] * sp.cos(one)
        right = a[4 + 2 * k] * sp.sin(two) + a[5 + 2 * k] * sp.cos(two)
        rows.append(("0", printer.terms(left + right - a[8 + k])))
    yield aligned(rows, end=",")
    yield "a quartic with up to four real roots."


def _turning(printer: FractionPrinter, printed: PrintedInverseStep) -> str:
    """The angle by which a joint turns about its axis."""
    return printer.tex(printed.sense * printed.name)


def _relation(printer: FractionPrinter, printed: PrintedInverseStep) -> str:
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
    """PrintedTerms of a sum, each but the first with its sign."""
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
        "The residual of a solution is the larger of the distance (m) and the angle (rad) between"
        " the pose that forward kinematics gives for it and the one that is asked for; up to"
        " $10^{-9}$ the solution is valid. Every step builds on what earlier ones gave, in a"
        " degenerate case on what was taken there: angles found independently of each other would"
        " not fit together."
    )


def _printer(page: Page) -> FractionPrinter:
    notation = page.equations.notation
    return FractionPrinter(notation.tex, notation.order)
