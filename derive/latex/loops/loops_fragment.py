r"""Prints the closure equations of loops as products of exponentials and as scalar equations."""

from collections.abc import Sequence
from functools import partial

import sympy as sp

from ...loops.functions.constraint_functions import equations
from ...loops.model.constraints import LoopEquations
from ...loops.model.exponentials import Factor
from ...model.mechanism import Closure
from ..chain.tables import Column, tabular
from ..setting.layout import aligned, filled
from ..setting.names import escape
from ..setting.page import listed, named_matrix, sentence, text
from ..setting.printed_terms import Definition
from ..setting.widths import LINE, width
from .loop_page import LoopPage

DECIMALS = 6


def loops(page: LoopPage) -> str:
    """Print the closure equations of each loop and the equations of its joint rates."""
    every = equations(page.hybrid)
    found = [loop for loop in every if isinstance(loop, LoopEquations)]
    shown = [_loop(page, loop, k) for k, loop in enumerate(found, 1)]
    count = sum(len(one.residual) for one in every)
    together = "Together these" if len(found) == len(every) else "With the couplings, these"
    z = listed(map(page.tex, page.joints.values()))
    if page.hybrid.least_squares_closure is not None:
        return text(_introduction(found), *shown, _least_squares(page, count, z))
    rates = sentence(
        rf"{together} are {count} equations $c(z) = 0$ in the {len(page.joints)} entries of"
        rf" $z$: {z}. Rates and accelerations that keep the loops closed satisfy",
        aligned(
            [
                (r"\frac{\partial c}{\partial z}\,\dot{z}", ["0"]),
                (
                    r"\frac{\partial c}{\partial z}\,\ddot{z}",
                    [r"-\frac{\mathrm{d}}{\mathrm{d}t}\frac{\partial c}{\partial z}\,\dot{z}"],
                ),
            ]
        ),
    )
    return text(_introduction(found), *shown, rates)


def _least_squares(page: LoopPage, count: int, z: str) -> str:
    c_p = r"\Bigl(\frac{\partial c}{\partial z_{\mathrm{p}}}\Bigr)^{\top}"
    meters = rf"{page.hybrid.numbers.size:.3g}\,\mathrm{{m}}"
    return sentence(
        rf"Together these are {count} equations $c(z) = 0$ in the {len(page.joints)} entries of"
        rf" $z$: {z}. Some constraints are redundant and contradict each other for the robot as"
        rf" built:"
        rf" {escape(str(page.hybrid.least_squares_closure))}. The configuration minimizes the sum"
        rf" of squared closure errors, entries of rotations times ${meters}$,",
        aligned([(f"g(z) = {c_p} c(z)", ["0"])], end=","),
        r"where $z_{\mathrm{p}}$ are the entries of $z$ that are not actuated. Rates and"
        r" accelerations satisfy $\frac{\partial g}{\partial z}\,\dot{z} = 0$ and its derivative.",
    )


def _introduction(equations: Sequence[LoopEquations]) -> str:
    one = "The loop is" if len(equations) == 1 else "Every loop is"
    return (
        rf"{one} closed if the product of the exponentials around it is $1$: out along one"
        r" branch, through the closure or member, and back along the other branch. The screws"
        r" $\mathcal{S} = (v; \omega)$ are given at the zero configuration, in the frame of the"
        r" body at which both branches meet; a component that is $0$ in all screws is omitted. $M$"
        r" is the displacement between the branches at this configuration."
    )


def _loop(page: LoopPage, loop: LoopEquations, number: int) -> str:
    freedoms = {
        factor.name: page.letters.next("freedom")
        for factor in loop.factors
        if factor.name not in page.joints
    }
    values = {**page.joints, **freedoms}
    is_open = loop.home != sp.eye(4)
    closed = [_exponential(page, values[f.name], f) for f in loop.factors if f.side != "b"]
    back = [_exponential(page, values[f.name], f) for f in loop.factors if f.side == "b"]
    home = rf"M_{{{number}}}"
    product = [*closed, *([home] if is_open else []), *back]
    definitions, entries = residual(page, loop)
    kind = "closure" if isinstance(loop.loop.loop_joint, Closure) else "member"
    meeting = page.members.called(loop.loop.meeting)
    which = "base" if loop.loop.meeting == page.mechanism.base_frame else f"body {meeting}"
    opening = (
        rf"\textbf{{Loop {number}}} is closed by the {kind} {page.members.called(loop.name)}; its"
        rf" branches meet at the {which}:"
    )
    where = f"where the screws{' and the displacement' if is_open else ''} are"
    terms = [
        (page.tex(name), page.printed_terms.printer.terms(value)) for name, value in definitions
    ]
    equals = [("0", page.printed_terms.printer.terms(entry)) for entry in entries]
    amounts = "The scalar equations are" if len(equals) > 1 else "The scalar equation is"
    return sentence(
        opening,
        _equals_one(product),
        where,
        _screws(page, loop, values),
        _home(page, home, loop.home) if is_open else "",
        amounts,
        aligned([*terms, *equals]) if terms else aligned(equals),
    )


def _exponential(page: LoopPage, value: sp.Symbol, factor: Factor) -> str:
    tex = page.tex(value)
    sign = "-" if factor.side == "b" else ""
    return rf"e^{{{sign}[\mathcal{{S}}_{{{tex}}}] {tex}}}"


def _equals_one(product: Sequence[str]) -> str:
    joined = [product[0], *(rf"\,{factor}" for factor in product[1:])]
    first, *rest = filled(joined, LINE - width("= 1,"))
    lines = [first, *(rf"\quad {line}" for line in rest)]
    lines[-1] += " = 1,"
    body = " \\\\\n".join(f"&{line}" for line in lines)
    return f"\\begin{{align*}}\n{body}\n\\end{{align*}}%"


def _screws(page: LoopPage, loop: LoopEquations, values: dict[str, sp.Symbol]) -> str:
    names = [rf"$\mathcal{{S}}_{{{page.tex(values[f.name])}}}$" for f in loop.factors]
    columns: list[Column] = [
        ("screw", names),
        ("joint", [page.members.called(f.name) for f in loop.factors]),
    ]
    heads = [rf"${part}_{axis}$" for part in ("v", r"\omega") for axis in "xyz"]
    rows = [[_constant(page, entry) for entry in factor.screw] for factor in loop.factors]
    columns += [(head, [row[k] for row in rows]) for k, head in enumerate(heads)]
    # The table omits screw components that are zero for all joints, as in a planar loop.
    shown = [column for column in columns if set(column[1]) != {"$0$"}]
    return tabular(shown, repeated=1)


def _home(page: LoopPage, name: str, M: sp.Matrix) -> str:
    rows = [[_constant(page, entry)[1:-1] for entry in row] for row in M.tolist()]
    end = "."
    if named_matrix(name, rows).width > LINE:
        rows = [[_decimal(page, entry) for entry in row] for row in M.tolist()]
        end = rf"\quad\text{{(to {DECIMALS} decimals)}}."
    return f"\\begin{{gather*}}\n{named_matrix(name, rows).tex}{end}\n\\end{{gather*}}%"


def _decimal(page: LoopPage, entry: sp.Expr) -> str:
    tex = _constant(page, entry)[1:-1]
    rounded = f"{round(float(page.terms.value(entry)), DECIMALS) + 0.0:.{DECIMALS}f}"
    return min(tex, rounded, key=width)


def _constant(page: LoopPage, entry: sp.Expr) -> str:
    return f"${page.tex(page.constant(entry))}$"


def residual(page: LoopPage, loop: LoopEquations) -> tuple[list[Definition], list[sp.Expr]]:
    """Return the definitions of long sums in brackets, and the scalar equations of a loop."""
    definitions: list[Definition] = []
    entries = []
    for entry in loop.residual:
        delta = partial(page.letters.next, "delta")
        shown, new = page.printed_terms.shortened(page.printed_terms.of(entry), delta)
        entries.append(shown)
        definitions += new
    return definitions, entries
