"""Converts the named terms of a derivation to the symbols that a LaTeX article prints."""

from collections.abc import Callable, Mapping

import sympy as sp

from ...terms.terms import Terms
from .notation import Notation, is_long, is_long_number, numbered
from .printer import FractionPrinter
from .widths import LINE, width

Definition = tuple[sp.Symbol, sp.Expr]
NARROW = 0.2 * LINE
"""Maximum width (pt) of a constant that is printed without a name."""
BRACKET = 0.36 * LINE
"""Maximum width (pt) of a sum that is written out in a product or a square."""
WRITTEN = 0.5 * LINE
"""Maximum width (pt) at which a sum is printed with all its constants."""


class PrintedTerms:
    """The printed symbols of the named terms of a solution.

    Attributes:
        known: The printed symbol of each named term and coordinate, with its sign.
    """

    def __init__(
        self, terms: Terms, notation: Notation, known: Mapping[sp.Symbol, sp.Expr]
    ) -> None:
        self.terms, self.notation, self.known = terms, notation, dict(known)
        self._long: dict[sp.Expr, sp.Symbol] = {}
        self._written: dict[sp.Symbol, sp.Expr] = {}
        self.printer = FractionPrinter.of(notation)

    def call(self, term: sp.Symbol, shown: sp.Expr) -> None:
        """Assign a printed symbol, possibly with a minus sign, to a named term."""
        self.known[term] = shown
        self._written.clear()

    def tex(self, expression: sp.Expr) -> str:
        """Format an expression in printed symbols as LaTeX."""
        return self.printer.tex(expression)

    def of(self, expression: sp.Expr) -> sp.Expr:
        """Convert an expression of named terms to printed symbols."""
        ordered = sorted(expression.free_symbols, key=numbered)
        known = {symbol: self._symbol(symbol) for symbol in ordered}
        for function in sorted(expression.atoms(sp.cos, sp.sin), key=str):
            # A cosine or sine that contains only parameters is a constant of the robot description.
            if function.free_symbols <= self.terms.parameters.keys():
                known[function] = self.notation.constant(function)
        return expression.xreplace(known)

    def meaning(self, term: sp.Symbol) -> sp.Expr:
        """Return the definition of a named term in printed symbols."""
        definition = self.terms.definitions[term]
        if isinstance(definition, sp.cos | sp.sin):
            return definition.func(self.sum(definition.args[0]))
        return self.of(definition)

    def exact(self, expression: sp.Expr) -> sp.Expr:
        """Convert a sum of constants and lengths to printed symbols.

        In a long sum, the constant factors of each length are collected.
        """
        number, rest = expression.as_independent(*expression.free_symbols, as_Add=True)
        shown = self.constant(number) if number != 0 else number
        written = shown + self.notation.shortened(self.of(rest))
        return written if width(self.tex(written)) <= WRITTEN else self._gathered(expression)

    def _gathered(self, expression: sp.Expr) -> sp.Expr:
        moving = {s for s in expression.free_symbols if not self.terms.is_constant(s)}
        factors: dict[sp.Expr, list[sp.Expr]] = {}
        for addend in sp.Add.make_args(sp.expand(expression)):
            constant, lengths = addend.as_independent(*moving, as_Add=False)
            factors.setdefault(lengths, []).append(constant)
        return sp.Add(
            *(
                self.constant(sp.Add(*constants)) * self.of(lengths)
                for lengths, constants in factors.items()
            )
        )

    def shortened(
        self, expression: sp.Expr, named: Callable[[], sp.Symbol]
    ) -> tuple[sp.Expr, list[Definition]]:
        """Replace long sums in brackets by symbols.

        Returns the shortened expression and the definitions of the new symbols.

        Args:
            expression: An expression in printed symbols.
            named: Function that returns the next unused symbol.
        """
        new: list[Definition] = []

        def name(sum_: sp.Expr) -> sp.Expr:
            if sum_ not in self._long:
                self._long[sum_] = named()
                new.append((self._long[sum_], sum_))
            return self._long[sum_]

        def inside(e: sp.Expr, *, is_bracket: bool) -> sp.Expr:
            if e.is_Atom:
                return e
            is_sum, is_root = e.is_Add, e.is_Pow and e.exp == sp.Rational(1, 2)
            e = e.func(*(inside(part, is_bracket=not (is_sum or is_root)) for part in e.args))
            return name(e) if is_bracket and e.is_Add and width(self.tex(e)) > BRACKET else e

        return inside(expression, is_bracket=False), new

    def sum(self, angle: sp.Expr) -> sp.Expr:
        """Return a sum of angles in printed symbols."""
        moving = {s for s in angle.free_symbols if not self.terms.is_constant(s)}
        constant, rest = sp.expand(angle).as_independent(*moving, as_Add=True)
        shown = self.notation.constant(self.terms.spelled(constant)) if constant != 0 else constant
        return shown + self.of(rest)

    def constant(self, expression: sp.Expr) -> sp.Expr:
        """Return a short constant, or the name of a long constant."""
        if is_long_number(self.terms, expression):
            return self.notation.constant(self.terms.value(expression))
        if is_long(self.terms, expression):
            return self.notation.constant(expression)
        raw = self.terms.spelled(expression)
        if raw.free_symbols:
            shown = self.notation.shortened(raw)
            if width(self.tex(shown)) <= NARROW:
                return shown
        elif raw.is_Rational and width(self.tex(raw)) <= NARROW:
            return raw
        return self.notation.constant(raw)

    def _symbol(self, symbol: sp.Symbol) -> sp.Expr:
        if symbol in self.known:
            return self.known[symbol]
        if symbol not in self._written:
            self._written[symbol] = self._in_full(symbol)
        return self._written[symbol]

    def _in_full(self, symbol: sp.Symbol) -> sp.Expr:
        if symbol in self.terms.constants:
            return self.constant(symbol)
        turned = self._turned(symbol)
        if turned is not None:
            return turned
        return self.meaning(symbol) if symbol in self.terms.definitions else symbol

    def _turned(self, symbol: sp.Symbol) -> sp.Expr | None:
        if symbol not in self.terms.turning:
            return None
        angle, _ = self.terms.turning[symbol]
        if any(s in self.terms.solved and s not in self.known for s in angle.free_symbols):
            return None
        for function, value in zip((sp.cos, sp.sin), self.terms.cos_sin(angle), strict=True):
            if value in (symbol, -symbol):
                return (1 if value == symbol else -1) * function(self.sum(angle))
        return None
