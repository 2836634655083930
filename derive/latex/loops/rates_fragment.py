r"""Prints the rate equations of every step of the loop solution, and the Jacobian."""

from collections.abc import Mapping

import sympy as sp

from ...loops.solve.solution import Solution
from ...model.sizes import addends
from ...terms.terms import derivative
from ..setting.layout import Equation, aligned
from ..setting.notation import OTHER
from ..setting.page import listed, sentence, text
from ..setting.widths import LINE, width
from .loop_page import LoopPage
from .members import dotted
from .printed_steps import PrintedLoopStep, PrintedRate

MAX_TERMS = 8
"""Maximum number of terms in a printed rate. If a rate has more terms, symbols replace the rates of
the intermediate results that it contains."""
MAX_EXPANDED = 500
"""A rate is expanded only if it has at most this number of terms after expansion."""
BRACKET = 0.75 * LINE
"""Maximum width (pt) of a sum in brackets that multiplies a joint rate."""


class Rates:
    """Computes the time derivatives of the expressions in a LaTeX article.

    Attributes:
        dotted: The rate symbol of each coordinate and unknown.
        definitions: The definition of each symbol that is neither a coordinate nor an unknown.
        inner: Symbols for rates of intermediate results, keyed by the symbol of the result. A rate
            that is printed as an expression has no entry in ``inner``.
    """

    def __init__(self, page: LoopPage, moving: Mapping[sp.Symbol, int]) -> None:
        self.page = page
        self.definitions: dict[sp.Symbol, sp.Expr] = {}
        self.inner: dict[sp.Symbol, sp.Symbol] = {}
        self._found: dict[sp.Symbol, sp.Expr] = {}
        self.dotted = {symbol: self._dotted(symbol, k) for symbol, k in moving.items()}

    def equations(self, step: PrintedLoopStep) -> list[tuple[PrintedRate, sp.Expr]]:
        """Return the rate equations of a solution step, with right-hand sides as expressions."""
        self.definitions |= dict(step.vectors)
        results = []
        for rate in step.rates:
            total = sp.Add(*(w * self.of(part) for part, w in rate.right))
            is_long = addends(total) > MAX_EXPANDED
            if not is_long:
                total = sp.expand(total)
            if is_long or len(sp.Add.make_args(total)) > MAX_TERMS:
                total = sp.Add(*(w * self._by_name(part) for part, w in rate.right))
            for symbol, _ in rate.left:
                if symbol not in self.dotted:
                    self.dotted[symbol] = self._dotted(symbol, len(self.dotted))
                    self._found.clear()
            results.append((rate, self._collected(total)))
        return results

    def left(self, rate: PrintedRate) -> str:
        """Format the left-hand side of a rate equation."""
        if rate.projected:
            arm, point = rate.projected
            return rf"({arm}) \cdot {dotted(point)}"
        return self.page.tex(sp.Add(*(weight * self.dotted[s] for s, weight in rate.left)))

    def of(self, expression: sp.Expr) -> sp.Expr:
        """Return the time derivative of an expression."""
        rates = {
            symbol: self.dotted.get(symbol) or self._of_definition(symbol)
            for symbol in sorted(expression.free_symbols, key=str)
            if symbol in self.dotted or symbol in self.definitions
        }
        return sp.Add(*(derivative(expression, symbol) * rate for symbol, rate in rates.items()))

    def _by_name(self, part: sp.Expr) -> sp.Expr:
        if part not in self.definitions:
            return self.of(part)
        if part not in self.inner:
            self.inner[part] = self._dotted(part, 1000 + len(self.inner))
        return self.inner[part]

    def _of_definition(self, symbol: sp.Symbol) -> sp.Expr:
        if symbol not in self._found:
            meaning = self.definitions[symbol]
            is_root = meaning.is_Pow and meaning.exp == sp.Rational(1, 2)
            rate = self.of(meaning.base) / (2 * symbol) if is_root else self.of(meaning)
            self._found[symbol] = rate
        return self._found[symbol]

    def _collected(self, total: sp.Expr) -> sp.Expr:
        rates = [*self.dotted.values(), *self.inner.values()]
        parts, expanded = [], sp.expand(total)
        for rate in rates:
            part = _by_angles(expanded.coeff(rate))
            is_long = part.is_Add and width(self.page.tex(part)) > BRACKET
            parts.append(sp.expand(part * rate) if is_long else part * rate)
        return sp.Add(*parts)

    def _dotted(self, symbol: sp.Symbol, place: int) -> sp.Symbol:
        notation = self.page.chain.equations.notation
        return notation.symbol(dotted(self.page.tex(symbol)), (OTHER, ("~", place)))


def _by_angles(part: sp.Expr) -> sp.Expr:
    functions = sorted(part.atoms(sp.cos, sp.sin), key=str)
    if not functions:
        return part
    return sp.Add(*map(_signed, sp.Add.make_args(sp.collect(part, functions))))


def _signed(addend: sp.Expr) -> sp.Expr:
    for factor in addend.args if addend.is_Mul else ():
        if factor.is_Add and factor.could_extract_minus_sign():
            return sp.Mul(-1, -factor, addend / factor)
    return addend


def rates(page: LoopPage) -> str:
    """Print the forward and inverse rate equations and the Jacobian."""
    forward, backward = page.hybrid.forward, page.hybrid.backward
    blocks = []
    main = [joint.name for joint in page.hybrid.robot.moving]
    actuated = [c.moves for c in page.mechanism.coordinates]
    if not forward.open:
        moving = {symbol: k for k, symbol in enumerate(page.q)}
        blocks.append(
            _rates(page, forward, page.forward_steps, moving, main, "the actuators' rates,")
        )
    if not set(actuated) & set(backward.open):
        moving = {symbol: k for k, symbol in enumerate(page.theta)}
        blocks.append(
            _rates(page, backward, page.backward_steps, moving, actuated, "the chain's rates,")
        )
    dead = (
        r"The differentiated closure equations are linear in the rates; the factors on the left"
        r" vanish at dead points."
    )
    return text(
        dead if page.mechanism.loop_joints else "",
        *blocks,
        _jacobian(page),
    )


def _rates(
    page: LoopPage,
    solved: Solution,
    steps: tuple[PrintedLoopStep, ...],
    moving: Mapping[sp.Symbol, int],
    wanted: list[str],
    given: str,
) -> str:
    found = Rates(page, moving)
    unknowns: list[Equation] = []
    for step in steps:
        for rate, total in found.equations(step):
            unknowns.append((found.left(rate), page.printed_terms.printer.terms(total)))
    # A solution step without equations, such as a serial arm, has no rate equations.
    without = {
        symbol
        for step in steps
        if step.step.reason
        for value in step.step.equations().unknowns.values()
        for symbol in value.free_symbols
    }
    joints, others = [], []
    for name in wanted:
        symbol = page.joints[name]
        if symbol in moving or name not in solved.values:
            continue
        if solved.values[name].free_symbols & without:
            others.append(dotted(page.tex(symbol)))
            continue
        value = found.of(page.printed_terms.sum(solved.values[name]))
        if symbol in found.dotted and value == found.dotted[symbol]:
            continue
        joints.append((dotted(page.tex(symbol)), page.printed_terms.printer.terms(value)))
    words = f"From {given}"
    rest = (
        rf"{listed(others)} {'follows' if len(others) == 1 else 'follow'} from"
        r" $\frac{\partial c}{\partial z}\,\dot{z} = 0$."
        if others
        else ""
    )
    if not unknowns:
        return sentence(words, aligned(joints), rest) if joints else sentence(rest) if rest else ""
    return sentence(
        words,
        aligned(unknowns, end="," if joints else "."),
        sentence("and with these", aligned(joints)) if joints else "",
        "Dots denote rates of intermediate results, by the chain rule." if found.inner else "",
        rest,
    )


def _jacobian(page: LoopPage) -> str:
    theta = r"\frac{\partial \theta}{\partial q}"
    maps = r"the factors of $\dot{q}$ in the rates above"
    if page.hybrid.forward.open:
        maps = (
            r"the solution of $\frac{\partial c}{\partial z}\,\dot{z} = 0$ for the rates of all"
            " joints that are not actuated"
        )
    return sentence(
        r"Let $J_\theta$ be the mixed Jacobian with respect to the main-chain joints $\theta$, and"
        rf" $\partial \theta / \partial q$ {maps}. In actuated coordinates, the twist of the tool"
        " and the Jacobian are",
        aligned([("V", [r"J_q\,\dot{q}"]), ("J_q", [rf"J_\theta\,{theta}"])]),
    )
