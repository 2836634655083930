"""Derivatives through named terms along given rates of the coordinates.

A :class:`Tangent` carries given rates of the coordinates through named terms by the chain
rule, one named term at a time. At the angle of a loop's solution it differentiates the loop's
equation instead of the solution: the rate of that equation is linear in the angle's rate (implicit
function theorem). The terms of cosine and sine of such an angle have the derivatives of cosine and
sine.
"""

from collections.abc import Callable, Mapping, Sequence

import sympy as sp

from .terms import Terms

ZERO = sp.Integer(0)
LoopRate = Callable[["Tangent"], sp.Expr]
"""The rate of a solved angle from the rates of the quantities in its loop's equation."""


class Tangent:
    """The rates of all named terms at given rates of the coordinates."""

    def __init__(
        self,
        terms: Terms,
        rates: Mapping[sp.Symbol, sp.Expr],
        loops: Mapping[sp.Symbol, LoopRate] | None = None,
    ) -> None:
        """Fixes the rates of the coordinates.

        Args:
            terms: Names of all terms.
            rates: Rate of each coordinate; other symbols without a definition are constant.
            loops: Solution of the loop's rate equation for each solved angle.
        """
        self.terms = terms
        self.loops = loops or {}
        self._rates: dict[sp.Symbol, sp.Expr] = dict(rates)
        self._solving: set[sp.Symbol] = set()

    def of(self, expression: sp.Expr) -> sp.Expr:
        """The named rate of an expression."""
        parts = []
        for symbol in sorted(expression.free_symbols, key=_by_name):
            rate = self._of_symbol(symbol)
            if rate != 0:
                parts.append(self.terms.partial(expression, symbol) * rate)
        return self.terms.let(sp.Add(*parts))

    def of_each(self, expressions: Sequence[sp.Expr]) -> list[sp.Expr]:
        """The named rates of expressions."""
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
        # A quantity in a loop's equation may be the cosine or sine of the angle that it gives.
        if angle != 0 and self._solving.isdisjoint(angle.free_symbols):
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
    """The named derivatives of expressions by coordinates, one column a coordinate.

    Args:
        terms: Names of all terms.
        expressions: The entries of a column.
        symbols: The coordinates.
        loops: For solved angles, the solution of their loop's rate equation.
        factor: Multiplies every derivative.
    """
    rate = sp.Integer(factor)
    return [Tangent(terms, {symbol: rate}, loops).of_each(expressions) for symbol in symbols]


def _by_name(symbol: sp.Symbol) -> tuple[int, str]:
    return len(symbol.name), symbol.name
