"""Converts the terms of an inverse kinematics task to printed symbols.

Products of terms are printed in full. Sums that are long or occur repeatedly are printed as terms
with names. The cosine and sine of a solved angle are printed as c and s with the index of the
angle.
"""

from collections import Counter
from collections.abc import Iterable, Sequence

import sympy as sp

from ...inverse.subproblems.turns import CosSin
from ...model.tolerances import ARTICLE_ZERO
from ...terms.terms import Terms
from ..setting.notation import numbered
from ..setting.printed_terms import PrintedTerms
from ..setting.sharing import (
    Definition,
    TermNames,
    is_trigonometric,
    open_terms,
)
from ..setting.widths import width
from .inverse_symbols import InverseSymbols

SHORT = 30.0
"""Minimum width (pt) at which the article introduces a symbol for a repeated sum or coefficient."""


class InverseTerms(TermNames):
    """The terms of an inverse kinematics task during their conversion to printed symbols.

    Attributes:
        changed: Printed definitions that differ from the original definitions, keyed by the symbol
            of the term.
        preferred: Names of terms that are vector components.
        uses: Number of occurrences of each term.
    """

    def __init__(self, terms: Terms, symbols: InverseSymbols) -> None:
        self.terms, self.symbols, self.notation = terms, symbols, symbols.notation
        self.printed_constants = PrintedTerms(terms, symbols.notation, {})
        self.printer = self.printed_constants.printer
        self.known, self.inlined = {}, {}
        self.changed: dict[sp.Symbol, sp.Expr] = {}
        self.preferred: dict[sp.Symbol, sp.Expr] = {}
        self.uses: Counter[sp.Symbol] = Counter()
        self.definitions = []

    def is_open(self, term: sp.Expr) -> bool:
        """Whether an expression is a term that has no printed name yet."""
        return term in self.terms.definitions and term not in self.known

    def seed(self, turn: CosSin, angle: sp.Expr) -> None:
        """Assign printed symbols to the cosine and the sine of a solved angle."""
        for function, value in ((sp.cos, turn.c), (sp.sin, turn.s)):
            sign, term = value.as_coeff_Mul()
            if self.is_open(term) and not is_trigonometric(self.terms.definitions[term]):
                self.known[term] = sign * self.trigonometric(function, angle)

    def define(self, name: sp.Symbol, value: sp.Expr) -> None:
        """Add the definition of a symbol to the definitions to print."""
        self.definitions.append((name, value))

    def trigonometric(self, function: type[sp.Function], angle: sp.Expr) -> sp.Expr:
        """Return the short symbol of the cosine or sine of an angle sum."""
        negative = angle.could_extract_minus_sign()
        angle = -angle if negative else angle
        known = angle.free_symbols <= {*self.notation.q}
        shown = self.notation.trigonometric(function(angle)) if known else function(angle)
        return -shown if negative and function is sp.sin else shown

    def _definition(self, term: sp.Symbol) -> sp.Expr:
        definition = self.changed.get(term, self.terms.definitions[term])
        tiny = {x: sp.Integer(0) for x in definition.atoms(sp.Float) if abs(x) < ARTICLE_ZERO}
        return definition.xreplace(tiny)

    def _open(self, entries: Iterable[sp.Expr]) -> list[sp.Symbol]:
        return open_terms(self.terms, self.known, entries, self._definition)

    def counted(self, entries: Sequence[sp.Expr]) -> Counter[sp.Symbol]:
        """Count the occurrences of each term in expanded products."""
        uses = Counter(symbol for entry in entries for symbol in entry.free_symbols)
        for term in reversed(self._open(entries)):
            definition = self._definition(term)
            if not is_trigonometric(definition):
                times = 1 if _is_nameable(definition) else uses[term]
                for addend in sp.Add.make_args(definition):
                    uses.update(dict.fromkeys(addend.free_symbols, times))
        return uses

    def settle_below(self, entry: sp.Expr) -> None:
        """Give names to the terms of an entry, or replace the terms by their definitions."""
        _, own = entry.as_coeff_Mul()
        for term in self._open([entry]):
            if term not in self.inlined:
                self._settle(term, is_once=term == own or self.uses[term] <= 1)

    def _settle(self, term: sp.Symbol, *, is_once: bool) -> None:
        definition = self._definition(term)
        if is_trigonometric(definition):
            self.known[term] = self._named_function(definition)
            return
        value = self.value(definition)
        if term in self.preferred:
            sign, name = self.preferred[term].as_coeff_Mul()
            self.known[term] = sign * name
            self.definitions.append((name, sign * value))
        elif isinstance(value, sp.Piecewise):
            self.known[term] = self.symbols.side()
            self.definitions.append((self.known[term], value))
        elif is_once or not _is_nameable(value) or self._is_short(value):
            self.inlined[term] = value
        else:
            self.name(term, value)

    def _named_function(self, function: sp.Expr) -> sp.Expr:
        (angle,) = function.args
        if angle.free_symbols & set(self.notation.q):
            return self.trigonometric(function.func, angle)
        return function.func(angle.xreplace(self.known))

    def _is_short(self, value: sp.Expr) -> bool:
        return value.is_Add and width(self.printer.tex(value)) < SHORT

    def value(self, expression: sp.Expr) -> sp.Expr:
        """Convert an expression to printed symbols.

        Each named term in the expression must already have a printed name, or a definition that is
        printed in its place.
        """
        self.name_long_factors(expression)
        known = {}
        for symbol in sorted(expression.free_symbols, key=numbered):
            if symbol in self.known:
                known[symbol] = self._lasting(symbol)
            elif symbol in self.inlined:
                known[symbol] = self.inlined[symbol]
            elif symbol in self.terms.constants:
                known[symbol] = self.printed_constants.constant(symbol)
        return _tidy(expression.xreplace(known))

    def _lasting(self, symbol: sp.Symbol) -> sp.Expr:
        shown = self.known[symbol]
        if isinstance(shown, sp.cos | sp.sin) and shown.free_symbols & set(self.notation.q):
            shown = self.known[symbol] = self.trigonometric(shown.func, shown.args[0])
        return shown

    def taken(self) -> list[Definition]:
        """Return the definitions that were added since the previous call of ``taken``."""
        taken, self.definitions = self.definitions, []
        return taken


def _tidy(expression: sp.Expr) -> sp.Expr:
    if expression.is_Add:
        return expression.func(*map(_tidy, expression.args))
    if not expression.is_Mul:
        return expression
    negative = [
        factor
        for factor in expression.args
        if factor.is_Add and all(term.as_coeff_Mul()[0].is_negative for term in factor.args)
    ]
    sign = sp.Integer(-1) ** len(negative)
    return sign * sp.Mul(*(-factor if factor in negative else factor for factor in expression.args))


def _is_nameable(expression: sp.Expr) -> bool:
    root = expression.is_Pow and expression.exp == sp.Rational(1, 2)
    return bool(expression.is_Add or root)
