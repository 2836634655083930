"""Prints the solution steps of an inverse kinematics task.

All axis structures share the same printing rules.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import sympy as sp

from ...inverse.subproblems.equations import (
    Direction,
    LineAndPlane,
    LineAndSphere,
    Linear,
    LoopOfThree,
    TwoEllipses,
)
from ..setting.layout import Equation, aligned
from ..setting.page import sentence
from ..setting.printer import FractionPrinter
from ..setting.sharing import Definition
from .printed_task import PrintedInverseStep


def _linear(equation: Linear, name: str, printer: FractionPrinter) -> str:
    left = [(equation.a, rf"\cos {name}"), (equation.b, rf"\sin {name}")]
    return f"{_sum(printer, left)} = {printer.tex(equation.d)}"


def _line_and_sphere(equation: LineAndSphere, name: str, printer: FractionPrinter) -> str:
    left = [(sp.Integer(1), f"{name}^2"), (equation.linear, name), (equation.constant, "")]
    return f"{_sum(printer, left)} = 0"


def _solution_alone(_equation: object, _name: str, _printer: FractionPrinter) -> str:
    return ""


def _loop_of_three(
    equation: LoopOfThree, angles: Sequence[sp.Expr], printer: FractionPrinter
) -> Iterable[str]:
    one, two, three = map(printer.tex, angles)
    p = [rf"\vec{{p}}_{{{k}}}" for k in range(4)]
    R = [rf"R(\vec{{k}}_{{{k}}}, {angle})" for k, angle in enumerate((one, two, three), 1)]
    yield rf"They solve ${p[0]} + {R[0]} {p[1]} = {R[1]} \bigl({p[2]} + {R[2]} {p[3]}\bigr)$ with"
    rows = []
    for name, vector in (
        (p[0], equation.p0),
        (r"\vec{k}_{1}", equation.k1),
        (p[1], equation.p1),
        (r"\vec{k}_{2}", equation.k2),
        (p[2], equation.p2),
        (r"\vec{k}_{3}", equation.k3),
        (p[3], equation.p3),
    ):
        x, y, z = map(printer.tex, vector)
        rows.append((name, [f"({x},", f"{y},", f"{z})"]))
    yield aligned(rows)
    yield (
        rf"The rotation by ${two}$ preserves the length of a vector and its component along"
        rf" $\vec{{k}}_{{2}}$. This gives two equations that are linear in the cosines and sines of"
        rf" ${one}$ and ${three}$, and from them a quartic with up to four real roots. Then"
        rf" ${two}$ rotates the bracket to the left-hand side."
    )


def _two_ellipses(
    equation: TwoEllipses, angles: Sequence[sp.Expr], printer: FractionPrinter
) -> Iterable[str]:
    yield "They solve"
    rows = []
    for one, two, right in zip(equation.first, equation.second, equation.right, strict=True):
        sums = [
            row[0] * sp.sin(angle) + row[1] * sp.cos(angle)
            for row, angle in zip((one, two), angles, strict=True)
        ]
        rows.append(("0", printer.terms(sums[0] + sums[1] - right)))
    yield aligned(rows, end=",")
    yield "which give a quartic with up to four real roots."


_RELATIONS: Mapping[type, Callable[[Any, str, FractionPrinter], str]] = {
    Linear: _linear,
    LineAndSphere: _line_and_sphere,
    Direction: _solution_alone,
    LineAndPlane: _solution_alone,
}
"""Functions that print an equation with one unknown, keyed by equation type. Each function takes
the equation, the LaTeX name of the unknown, and the printer as arguments."""
_JOINT_RELATIONS: Mapping[
    type, Callable[[Any, Sequence[sp.Expr], FractionPrinter], Iterable[str]]
] = {LoopOfThree: _loop_of_three, TwoEllipses: _two_ellipses}
"""Functions that print an equation with several angles, keyed by equation type."""


def solved_step(printed: PrintedInverseStep, printer: FractionPrinter) -> str:
    """Print a solution step with one unknown."""
    name = printer.tex(printed.name)
    related = _RELATIONS[type(printed.equation)](printed.equation, name, printer)
    shared = definitions(printer, printed.definitions)
    solution = aligned([(name, _signed([printer.tex(term) for term in printed.solution]))])
    blocks = [f"It solves ${related}$," if related else "It is"]
    if shared:
        blocks = [
            blocks[0] if related else "",
            "with" if related else "With",
            aligned(shared, end=","),
        ]
    blocks.append("so that" if related else "it is" if shared else "")
    return sentence(*blocks, solution)


def solved_together(steps: Sequence[PrintedInverseStep], printer: FractionPrinter) -> str:
    """Print the equation that determines the unknowns of several solution steps together."""
    first = steps[0]
    shared = definitions(printer, first.definitions)
    blocks = ["With", aligned(shared)] if shared else []
    angles = [step.sense * step.name for step in steps]
    rule = _JOINT_RELATIONS[type(first.equation)]
    return sentence(*blocks, *rule(first.equation, angles, printer))


def definitions(printer: FractionPrinter, found: Iterable[Definition]) -> list[Equation]:
    """Return the definitions of named terms as rows of an aligned LaTeX display."""
    return [(printer.tex(name), _terms(printer, value)) for name, value in found]


def _terms(printer: FractionPrinter, value: sp.Expr) -> list[str]:
    if not isinstance(value, sp.Piecewise):
        return printer.terms(value)
    (one, condition), (other, _) = value.args
    side = printer.tex(condition.lhs)
    return [rf"{printer.tex(one)} \text{{ if }} {side} \ge 0, \text{{ else }} {printer.tex(other)}"]


def _sum(printer: FractionPrinter, products: Iterable[tuple[sp.Expr, str]]) -> str:
    return " ".join(_signed([_times(printer, *each) for each in products if each[0] != 0])) or "0"


def _times(printer: FractionPrinter, factor: sp.Expr, function: str) -> str:
    if function and factor in (1, -1):
        return function if factor == 1 else f"-{function}"
    return f"{printer.tex(factor)} {function}".rstrip()


def _signed(terms: Sequence[str]) -> list[str]:
    rest = (f"- {t[1:]}" if t.startswith("-") else f"+ {t}" for t in terms[1:])
    return [*terms[:1], *rest]
