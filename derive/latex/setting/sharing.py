"""Converts the functions of a serial robot to printed equations with shared terms.

A derivation names every intermediate result, but the printed equations name only some of these
results. Products and sums that occur once are written out. Sums that are long or occur repeatedly
become shared terms. All functions of a robot use the same shared terms. For example, the Jacobians
use terms of the forward kinematics.
"""

from collections import Counter
from collections.abc import Callable, Collection, Container, Iterable, Sequence
from dataclasses import dataclass

import sympy as sp

from ...derivation import Derivation, derive
from ...model.robot import SerialRobot
from ...terms.symbolic_function import SymbolicFunction
from ...terms.terms import Terms
from .notation import Notation, numbered
from .printer import Printer
from .widths import LINE, width

Definition = tuple[sp.Symbol, sp.Expr]
PRINTED = ("fk", "jacobian_mixed", "jacobian_space")
"""The printed functions."""
BRACKET = 0.36 * LINE
"""Maximum width (pt) of a sum that is written out in brackets."""
DEEPEST = 2
"""Maximum depth of nested brackets."""
ENTRY = 0.4 * LINE
"""Maximum width (pt) of a Jacobian entry."""
MAX_FACTORS = 5
"""Maximum number of factors in a product that is printed without a name."""


@dataclass(frozen=True)
class Printed:
    """The entries of a function, with short symbols for shared terms.

    Attributes:
        definitions: Definitions of the function's new shared terms, each after the terms on which
            it depends.
        entries: The entries in row-major order.
        names: The name of each entry, or None for an entry without a name.
    """

    definitions: tuple[Definition, ...]
    entries: tuple[sp.Expr, ...]
    names: tuple[sp.Symbol | None, ...] = ()


@dataclass(frozen=True)
class PrintedEquations:
    """The printed functions of a robot and the derived forward kinematics."""

    notation: Notation
    printer: Printer
    fk: Printed
    jacobian_mixed: Printed
    jacobian_space: Printed
    forward: SymbolicFunction


def equations(
    derivation: Derivation, called: Sequence[str] = (), reserved: Collection[str] = ()
) -> PrintedEquations:
    """Return the forward kinematics and the Jacobians in short symbols.

    If the derivation lacks the forward kinematics or a Jacobian, all of these functions are
    derived.

    Args:
        derivation: Derivation of a serial robot's functions.
        called: LaTeX symbols of the coordinates, or () if the coordinates are called q_1, q_2, ...
        reserved: Letters that have another meaning in the LaTeX article, so that no short symbol
            may use them.
    """
    robot = derivation.robot
    assert isinstance(robot, SerialRobot)
    if not {function.name for function in derivation.functions}.issuperset(PRINTED):
        derivation = derive(robot, functions=PRINTED)
    fk = derivation.function("fk")
    notation = Notation(robot, derivation.terms, fk.inputs[0].symbols, called, reserved)
    printer = Printer.of(notation)
    sharing = _Sharing(notation, printer)
    return PrintedEquations(
        notation,
        printer,
        sharing.printed(fk.outputs[0].entries, notation.entries()),
        sharing.printed(derivation.function("jacobian_mixed").outputs[0].entries),
        sharing.printed(derivation.function("jacobian_space").outputs[0].entries),
        fk,
    )


class TermNames:
    """Names of the terms in printed equations.

    Attributes:
        notation: The robot's short symbols.
        printer: The printer for expressions that contain the short symbols.
        known: The signed symbol of each named term.
        inlined: Printed expressions of the terms that have no name.
        definitions: The definitions of the named terms.
    """

    notation: Notation
    printer: Printer
    known: dict[sp.Symbol, sp.Expr]
    inlined: dict[sp.Symbol, sp.Expr]
    definitions: list[Definition]

    def name_long_factors(self, expression: sp.Expr) -> None:
        """Give a name to each factor that is too wide or too deeply nested for brackets."""
        for addend in sp.Add.make_args(expression):
            factors = sp.Mul.make_args(addend.as_coeff_Mul()[1])
            for factor in factors:
                base = factor.base if factor.is_Pow else factor
                value = self.inlined.get(base)
                if value is not None and (factor.is_Pow or len(factors) > 1):
                    self._fit_in_brackets(base, value)

    def _fit_in_brackets(self, term: sp.Symbol, value: sp.Expr) -> None:
        if value.is_Add and (depth(value) >= DEEPEST or width(self.printer.tex(value)) > BRACKET):
            self.name(term, value)

    def name(self, term: sp.Symbol, value: sp.Expr) -> None:
        """Define a term as the next shared term.

        If the printed value starts with a minus sign, the shared term denotes the negated value.
        """
        name = self.notation.term()
        sign = -1 if self.printer.tex(value).startswith("-") else 1
        self.definitions.append((name, sign * value))
        self.known[term] = sign * name
        self.inlined.pop(term, None)


class _Sharing(TermNames):
    def __init__(self, notation: Notation, printer: Printer) -> None:
        self.notation, self.printer = notation, printer
        self.terms = notation.terms
        self.known = {}

    def printed(
        self, entries: Sequence[sp.Expr], names: Sequence[sp.Symbol | None] = ()
    ) -> Printed:
        self.inlined, self.definitions = {}, []
        open_terms = self._open(entries)
        own = self._nameable(open_terms, entries) if names else set()
        uses = self._uses(open_terms, entries)
        for term in open_terms:
            self._settle(term, 1 if term in own else uses[term])
        if names:
            shown = self._named_entries(entries, names, own)
        else:
            shown = [self._column_entry(entry) for entry in entries]
        return Printed(tuple(self.definitions), tuple(shown), tuple(names))

    def _open(self, entries: Sequence[sp.Expr]) -> list[sp.Symbol]:
        return open_terms(self.terms, self.known, entries, self.terms.definitions.__getitem__)

    def _nameable(
        self, open_terms: Sequence[sp.Symbol], entries: Sequence[sp.Expr]
    ) -> set[sp.Symbol]:
        inside = {
            symbol for term in open_terms for symbol in self.terms.definitions[term].free_symbols
        }
        symbols = {symbol for entry in entries for symbol in entry.free_symbols}
        return {
            symbol
            for symbol in symbols - inside
            if symbol in self.terms.definitions and self.terms.definitions[symbol].is_Add
        }

    def _uses(
        self, open_terms: Sequence[sp.Symbol], entries: Sequence[sp.Expr]
    ) -> Counter[sp.Symbol]:
        uses = Counter(symbol for entry in entries for symbol in entry.free_symbols)
        for term in reversed(open_terms):
            expression = self.terms.definitions[term]
            if not is_trigonometric(expression):
                times = 1 if expression.is_Add else uses[term]
                for addend in sp.Add.make_args(expression):
                    uses.update(dict.fromkeys(addend.free_symbols, times))
        return uses

    def _settle(self, term: sp.Symbol, uses: int) -> None:
        expression = self.terms.definitions[term]
        if is_trigonometric(expression):
            self.known[term] = self.notation.trigonometric(expression)
            return
        value = self._value(expression)
        long = len(sp.Mul.make_args(value)) > MAX_FACTORS
        if uses > 1 and (long or (value.is_Add and not self._is_plain(value))):
            self.name(term, value)
        else:
            self.inlined[term] = value

    def _value(self, expression: sp.Expr) -> sp.Expr:
        self.name_long_factors(expression)
        known = {}
        # The symbols are sorted, because the order of a Python set varies.
        for symbol in sorted(expression.free_symbols, key=numbered):
            if symbol in self.terms.constants:
                known[symbol] = self.notation.constant(symbol)
            elif symbol in self.terms.definitions:
                known[symbol] = self.known.get(symbol, self.inlined.get(symbol))
        return expression.xreplace(known)

    def _named_entries(
        self,
        entries: Sequence[sp.Expr],
        names: Sequence[sp.Symbol | None],
        own: set[sp.Symbol],
    ) -> list[sp.Expr]:
        shown = []
        for entry, name in zip(entries, names, strict=True):
            shown.append(self._value(entry))
            sign, symbol = entry.as_coeff_Mul()
            if name is not None and symbol in own and symbol not in self.known:
                self.known[symbol] = sign * name
        return shown

    def _column_entry(self, entry: sp.Expr) -> sp.Expr:
        value = self._value(entry)
        if value.is_Add and width(self.printer.tex(value)) > ENTRY:
            _, symbol = entry.as_coeff_Mul()
            self.name(symbol, self.inlined[symbol])
            value = self._value(entry)
        return value

    def _is_plain(self, value: sp.Expr) -> bool:
        plain = {*self.notation.q, *self.terms.parameters}
        return len(value.args) == 2 and all(  # noqa: PLR2004
            addend.is_Rational or addend.as_coeff_Mul()[1] in plain for addend in value.args
        )


def open_terms(
    terms: Terms,
    known: Container[sp.Symbol],
    entries: Iterable[sp.Expr],
    definition: Callable[[sp.Symbol], sp.Expr],
) -> list[sp.Symbol]:
    """Return the unnamed terms on which the entries depend, in definition order.

    Args:
        terms: The terms.
        known: The named terms.
        entries: Expressions in terms.
        definition: The printed definition of a term.
    """
    found: set[sp.Symbol] = set()
    waiting = [symbol for entry in entries for symbol in entry.free_symbols]
    while waiting:
        symbol = waiting.pop()
        if symbol in terms.definitions and symbol not in known and symbol not in found:
            found.add(symbol)
            if not is_trigonometric(definition(symbol)):
                waiting.extend(definition(symbol).free_symbols)
    return [symbol for symbol in terms.definitions if symbol in found]


def is_trigonometric(expression: sp.Expr) -> bool:
    """Whether an expression is a cosine or a sine."""
    return isinstance(expression, sp.cos | sp.sin)


def depth(expression: sp.Expr) -> int:
    """Return the depth of nested brackets in a printed expression."""
    if expression.is_Add:
        return max(depth(addend) for addend in expression.args)
    return max((1 + depth(f) for f in sp.Mul.make_args(expression) if f.is_Add), default=0)
