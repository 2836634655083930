r"""Prints the closed-form solution of the loops."""

import math
from collections.abc import Iterable, Sequence

import sympy as sp

from ...inverse.arms.arm_step import from_chain_with_arms
from ...loops.functions.tool import tool_groups
from ...loops.model.phasors import ZERO, Complex
from ...loops.solve.collapse import collapsed
from ...loops.solve.solution import Solution
from ...model.plural import counted
from ..chain.example_fragment import at_value
from ..setting.layout import INDENT, MARGIN, Equation, aligned
from ..setting.notation import OTHER
from ..setting.page import listed, sentence, text
from ..setting.printed_terms import Definition, PrintedTerms
from ..setting.widths import LINE, width
from .arms_fragment import arms
from .loop_page import LoopPage
from .printed_steps import PrintedLoopStep

SPACE = r"\,"
MAX_ZEROS = 4
"""The dead points of a solution step are listed only if there are at most this many."""
MIN_PRINTED = 0.01
"""The lower bound of a step's margin is printed only if the bound exceeds this value."""


def solution(page: LoopPage) -> str:
    """Print the solution of the loops for known actuators, then for known main-chain joints."""
    forward, backward = page.hybrid.forward, page.hybrid.backward
    actuated = {c.moves for c in page.mechanism.coordinates}
    main = [joint.name for joint in page.hybrid.robot.moving]
    return text(
        _note(page),
        rf"\paragraph{{From the actuators.}} {_given(page.members.q)}",
        *[_step(page, step) for step in page.forward_steps],
        _results(page, forward, "All joints follow as", known=set()),
        _overdetermined(page) or _open(page, forward),
        *_collapsed(page),
        rf"\paragraph{{From the main chain.}} {_given(page.members.theta)}",
        *[_step(page, step) for step in page.backward_steps],
        _results(page, backward, "All other joints follow as", known=set(main)),
        _by_arms(page) or _open(page, backward, [*actuated]),
        *arms(page),
    )


def _given(symbols: Sequence[str]) -> str:
    return f"Given {'is' if len(symbols) == 1 else 'are'} {listed(symbols)}."


def _note(page: LoopPage) -> str:
    if not (page.forward_steps or page.backward_steps):
        return ""
    return (
        r"Vectors in the plane of a loop are complex numbers in the axes of one of its bodies."
        r" Each root has the branch of the reference configuration. A margin is positive if the"
        r" loop of the step closes, $0$ at a dead point and negative out of reach. Angles are"
        r" between $-\pi$ and $\pi$."
    )


def _step(page: LoopPage, printed: PrintedLoopStep) -> str:
    step = printed.step
    if step.continues:
        return ""
    joints = [page.members.with_symbol(name) for name in step.joints]
    opening = rf"\textbf{{Step {printed.number}: {step.title}}} -- {', '.join(joints)}."
    if not (printed.unknown or printed.vectors or printed.results):
        return sentence(f"{opening} {step.reason}")
    vectors, results = _equations(page, printed.vectors), _equations(page, printed.results)
    results += [
        (page.tex(a.symbol), [rf"\operatorname{{atan2}}({page.tex(a.sine)}, {page.tex(a.cosine)})"])
        for a in printed.angles
    ]
    blocks = [f"{opening} {step.opening or _axes(page, printed)}"]
    if printed.unknown:
        blocks.append(aligned([_relation(page, printed)], end="," if vectors or results else "."))
    if vectors:
        blocks += ["with" if printed.unknown else "", aligned(vectors, end="," if results else ".")]
    if results:
        blocks += ["and is solved by" if printed.unknown else "so that", aligned(results)]
    return sentence(*blocks, printed.remark, _margin(page, printed))


def _equations(page: LoopPage, definitions: Iterable[Definition]) -> list[Equation]:
    return [(page.tex(name), page.vectors.terms(value)) for name, value in definitions]


def _axes(page: LoopPage, printed: PrintedLoopStep) -> str:
    axes = f"In the axes of {_body(page, printed.step.axes)}"
    turned = printed.step.turned
    if turned != 0 and printed.vectors:
        shown = page.tex(page.printed_terms.sum(turned))
        axes += f" (the components below are rotated by ${shown}$)"
    return f"{axes}, {'the loop is' if printed.unknown else 'let'}"


def _body(page: LoopPage, name: str) -> str:
    return "the base" if name == page.mechanism.base_frame else page.members.called(name)


def _relation(page: LoopPage, printed: PrintedLoopStep) -> Equation:
    def terms(side: Sequence[tuple[sp.Expr, Complex]]) -> list[str]:
        found = page.printed_terms.printer.terms(_phasors(page.printed_terms, side))
        return [_tight(term) for term in found]

    left, right = " ".join(terms(printed.unknown)), terms(printed.given)
    if width(f"{left} =") + max(map(width, right)) < LINE - INDENT - MARGIN:
        return left, right
    summands = [*printed.unknown, *((angle, (-x, -y)) for angle, (x, y) in printed.given)]
    if max(map(width, terms(summands))) > LINE - 2 * INDENT - MARGIN:
        summands = [(angle, part) for angle, (x, y) in summands for part in ((x, ZERO), (ZERO, y))]
    return "0", terms(summands)


def _tight(term: str) -> str:
    return term.replace(rf"- {SPACE}", "- ").replace(rf"+ {SPACE}", "+ ").removeprefix(SPACE)


def _phasors(terms: PrintedTerms, vectors: Iterable[tuple[sp.Expr, Complex]]) -> sp.Expr:
    i = terms.notation.symbol(r"\mathrm{i}", (OTHER, ("a",)))
    total = sp.S.Zero
    for k, (angle, (re, im)) in enumerate(vectors):
        turn = sp.S.One
        if angle != 0:
            tex = terms.tex(angle)
            sign = "-" if tex.startswith("-") and not angle.is_Add else ""
            inner = rf"({tex})" if angle.is_Add else tex.removeprefix("-")
            exponent = rf"{SPACE}\mathrm{{e}}^{{{sign}\mathrm{{i}}{inner}}}"
            turn = terms.notation.symbol(exponent, (OTHER, ("b", k)))
        total += (re + i * im) * turn
    return total


def _margin(page: LoopPage, printed: PrintedLoopStep) -> str:
    if printed.margin is None:
        return ""
    margin = rf"\mu_{{{printed.number}}}"
    message = rf"The margin is ${margin} = {_quotient(page, printed.margin)}$."
    if not printed.dead_point:
        return message
    dead = rf"{message} It is $0$ if {printed.dead_point}"
    found = page.dead_values.get(printed.number)
    if found is None:
        return f"{dead}."
    symbol = page.members.q[found.coordinate]
    coordinate = page.mechanism.coordinates[found.coordinate]
    if found.zeros and len(found.zeros) <= MAX_ZEROS:
        zeros = " and ".join(at_value(symbol, coordinate, zero) for zero in found.zeros)
        return f"{dead}, at {zeros}."
    if not found.zeros and found.least > MIN_PRINTED:
        within = " within the limits" if None not in coordinate.limits else ""
        return rf"{dead}; for all ${symbol}${within}, ${margin} \ge {_floor(found.least)}$."
    return f"{dead}."


def _floor(value: float) -> str:
    places = 1 - math.floor(math.log10(value))
    return f"{math.floor(value * 10**places) / 10**places:.{places}f}"


def _quotient(page: LoopPage, value: sp.Expr) -> str:
    above, below = sp.fraction(value)
    (factor, above), (divisor, below) = above.as_coeff_Mul(), below.as_coeff_Mul()
    # The two decimal factors are combined, because one decimal number is easier to read than a
    # quotient of two.
    below = divisor / factor * below
    over = page.tex(above)
    if below == 1:
        return over
    over = f"({over})" if above.is_Add else over
    return (
        f"{over} / {page.tex(below) if below.is_Atom or below.is_Pow else f'({page.tex(below)})'}"
    )


def _results(page: LoopPage, solved: Solution, opening: str, known: set[str]) -> str:
    found: list[Equation] = []
    for name, symbol in page.joints.items():
        value = solved.values.get(name)
        if value is None or name in known:
            continue
        shown = page.printed_terms.sum(value)
        if shown != symbol:
            found.append((page.tex(symbol), page.printed_terms.printer.terms(shown)))
    if known:
        for tex, c in zip(page.members.q, page.mechanism.coordinates, strict=True):
            value = page.joints[c.moves] / page.constant(c.ratio)
            if page.tex(value) != tex and c.moves in solved.values:
                found.append((tex, page.printed_terms.printer.terms(value)))
    return sentence(opening, aligned(found)) if found else ""


def _overdetermined(page: LoopPage) -> str:
    hybrid = page.hybrid
    if not hybrid.is_overdetermined:
        return ""
    return (
        f"The {len(hybrid.q)} actuators outnumber the {counted(hybrid.freedoms, 'degree')} of"
        " freedom. The loops close only for some actuator values, so that these values do not"
        " determine the joints."
    )


def _by_arms(page: LoopPage) -> str:
    """List the actuated joints that serial arms determine in closed form, or return ""."""
    if from_chain_with_arms(page.hybrid) is None:
        return ""
    open_ = page.hybrid.backward.open
    moved = [c.moves for c in page.mechanism.coordinates if c.moves in open_]
    names = listed(page.tex(page.joints[name]) for name in moved)
    return f"Serial arms between known bodies determine {names} in closed form."


def _open(page: LoopPage, solved: Solution, wanted: Sequence[str] = ()) -> str:
    names = [name for name in solved.open if name in page.joints and (not wanted or name in wanted)]
    if not names:
        return ""
    unknown = listed(page.tex(page.joints[name]) for name in names)
    p = r"z_{\mathrm{p}}"
    c, power = ("c", "+") if page.hybrid.least_squares_closure is None else ("g", "-1")
    newton = (
        p,
        [
            rf"\leftarrow {p} - \Bigl(\frac{{\partial {c}}}{{\partial {p}}}\Bigr)^{{{power}}}"
            rf" {c}(z)"
        ],
    )
    return sentence(
        rf"There is no closed form for {unknown}. Newton's iteration on the"
        r" closure equations solves for them along a path from the reference configuration,",
        rf"\begin{{equation*}}\n{newton[0]} {newton[1][0]},\n\end{{equation*}}%".replace(
            r"\n", "\n"
        ),
        rf"where ${p}$ are the unknown entries of $z$.",
    )


def _collapsed(page: LoopPage) -> list[str]:
    hybrid = page.hybrid
    if hybrid.forward.open:
        return []
    count = len(hybrid.robot.moving)
    shorter, translations = collapsed(
        page.terms, tool_groups(hybrid), hybrid.forward.relations, count
    )
    if not translations:
        return []
    stations = [station for group in shorter for station in group.stations]
    kept = {station.joint for station in stations}
    moving = [
        s.joint for group in tool_groups(hybrid) for s in group.stations if s.joint is not None
    ]
    gone = [joint for joint in moving if joint not in kept]
    merged = [[s for s in station.slides if s.joint >= count] for station in stations]
    moves = [
        (
            f"{name}{mark}",
            page.printed_terms.printer.terms(page.printed_terms.of(translations[s.joint - count])),
        )
        for k, slides in enumerate(filter(None, merged), 1)
        for mark in (f"_{{{k}}}" if sum(map(bool, merged)) > 1 else "",)
        for s in slides
        for name in (r"\Delta x" if s.direction[0] == 1 else r"\Delta y",)
    ]
    return [
        sentence(
            rf"The angles {listed(page.members.theta[k] for k in gone)} of the main chain have a"
            " constant sum, so that the bodies after these joints only translate,",
            aligned(moves, end=","),
            "in the plane of these joints. The closure equations eliminate all solved angles.",
        )
    ]
