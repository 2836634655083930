"""Time derivatives of named terms.

A ``Tangent`` applies the chain rule to one named term at a time. The rate of a solved loop angle
follows from the differentiated loop equation, which is linear in this rate (implicit function
theorem). The cosine and sine of a solved angle are differentiated directly with respect to the
angle.
"""

from collections.abc import Callable, Mapping, Sequence

import sympy as sp

from .terms import Terms

ZERO = sp.Integer(0)
LoopRate = Callable[["Tangent"], sp.Expr]
"""Function that returns the rate of a solved loop angle. The ``Tangent`` argument supplies the
rates of the other symbols in the loop equation."""


class Tangent:
    """The rates of all named terms for given rates of the coordinates."""

    def __init__(
        self,
        terms: Terms,
        rates: Mapping[sp.Symbol, sp.Expr],
        loops: Mapping[sp.Symbol, LoopRate] | None = None,
    ) -> None:
        self.terms = terms
        self.loops = loops or {}
        self._rates: dict[sp.Symbol, sp.Expr] = dict(rates)
        self._solving: set[sp.Symbol] = set()

    def of(self, expression: sp.Expr) -> sp.Expr:
        """Return the rate of an expression as a named term."""
        parts = []
        for symbol in sorted(expression.free_symbols, key=_by_name):
            rate = self._of_symbol(symbol)
            if rate != 0:
                parts.append(self.terms.partial(expression, symbol) * rate)
        return self.terms.let(sp.Add(*parts))

    def of_each(self, expressions: Sequence[sp.Expr]) -> list[sp.Expr]:
        """Return the rates of expressions as named terms."""
        return [self.of(expression) for expression in expressions]

    def _of_symbol(self, symbol: sp.Symbol) -> sp.Expr:
        if symbol not in self._rates:
            self._rates[symbol] = self._found(symbol)
        return self._rates[symbol]

    def _found(self, symbol: sp.Symbol) -> sp.Expr:
        if symbol in self.loops:
            self._solving.add(symbol)
            rate = self.loops[symbol](self)
            self._solving.remove(symbol)
            return rate
        angle, derivative = self.terms.turning.get(symbol, (ZERO, ZERO))
        # If the rate of the angle is still being computed, differentiate the definition of the
        # cosine or sine instead. The same applies if the angle depends on a solved angle that is
        # not in `loops`.
        parts = angle.free_symbols
        is_known = parts & self.terms.solved.keys() <= self.loops.keys()
        if angle != 0 and is_known and self._solving.isdisjoint(parts):
            return self.terms.let(derivative * self.of(angle))
        definition = self.terms.definitions.get(symbol)
        return ZERO if definition is None else self.of(definition)


def derivative_columns(
    terms: Terms,
    expressions: Sequence[sp.Expr],
    symbols: Sequence[sp.Symbol],
    loops: Mapping[sp.Symbol, LoopRate] | None = None,
    factor: int = 1,
) -> list[list[sp.Expr]]:
    """Return the derivatives of expressions, as one column for each coordinate.

    Args:
        terms: Table of named terms.
        expressions: The expressions whose derivatives form one column.
        symbols: The coordinates.
        loops: For each solved loop angle, a function that computes the angle's rate from the
            differentiated loop equation.
        factor: Multiplies every derivative.
    """
    rate = sp.Integer(factor)
    return [Tangent(terms, {symbol: rate}, loops).of_each(expressions) for symbol in symbols]


def _by_name(symbol: sp.Symbol) -> tuple[int, str]:
    return len(symbol.name), symbol.name
