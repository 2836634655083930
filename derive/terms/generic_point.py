"""Values of terms at generic configurations, which show whether a term is always zero.

Terms that are equal at a generic configuration count as always equal. Terms are compared with 40
digits.
"""

from collections.abc import Sequence

import mpmath
import sympy as sp

from ..model.tolerances import EVALUATION_DIGITS, WORKING_DIGITS, ZERO_COMPONENT
from ..model.values import NoValue, to_digits, value_at
from .terms import Terms


class GenericPoint:
    """A generic configuration at which terms are evaluated with 40 digits."""

    def __init__(self, terms: Terms, symbols: Sequence[sp.Symbol], phase: int = 0) -> None:
        """Set the configuration."""
        self.terms = terms
        self.values: dict[sp.Symbol, sp.Expr] = {}
        for k, symbol in enumerate(symbols):
            default = terms.parameters.get(symbol, sp.S.Zero)
            part = _between_0_and_1(phase * len(symbols) + k + 1, phase)
            self.values[symbol] = (default + part).evalf(EVALUATION_DIGITS)
        for symbol, default in terms.parameters.items():
            self.values.setdefault(symbol, default.evalf(EVALUATION_DIGITS))

    def value(self, expression: sp.Expr) -> sp.Expr:
        """Return the numerical value of an expression that may contain named terms."""
        for symbol, definition in self.terms.constants.items():
            self._add(symbol, definition)
        for symbol in self.terms.needed([expression]):
            self._add(symbol, self.terms.definitions[symbol])
        return self._evaluated(expression)

    def _add(self, symbol: sp.Symbol, definition: sp.Expr) -> None:
        if symbol not in self.values:
            self.values[symbol] = self._evaluated(definition)

    def _evaluated(self, expression: sp.Expr) -> sp.Expr:
        numbers = {symbol: self.values[symbol] for symbol in expression.free_symbols}
        try:
            return to_digits(value_at(expression, numbers))
        except NoValue:
            # The expression may contain the root of a negative number. SymPy evaluates such an
            # expression, but far more slowly.
            return expression.xreplace(numbers).evalf(EVALUATION_DIGITS)


def _between_0_and_1(number: int, phase: int) -> sp.Expr:
    """Return a number between 0 and 1 that depends on `number` and `phase`.

    The fractional parts of multiples of the golden ratio all differ.
    """
    with mpmath.workdps(WORKING_DIGITS):
        golden = (mpmath.sqrt(5) - 1) / 2
        part = number * golden + phase * number**2 * mpmath.sqrt(2)
        return sp.Float(part - mpmath.floor(part), WORKING_DIGITS)


def coordinates_in(terms: Terms, entries: Sequence[sp.Expr]) -> list[sp.Symbol]:
    """Return the coordinates in expressions and in their terms' definitions, sorted by name."""
    meanings = [terms.definitions[symbol] for symbol in terms.needed(entries)]
    used = {symbol for e in (*entries, *meanings) for symbol in e.free_symbols}
    found = {s for s in used if s not in terms.definitions and not terms.is_constant(s)}
    return sorted(found, key=str)


def vanishes(terms: Terms, value: sp.Expr) -> bool:
    """Whether a length is zero for all values of the parameters and coordinates."""

    def is_zero() -> bool:
        generic = GenericPoint(terms, [*coordinates_in(terms, [value]), *terms.parameters])
        return bool(abs(generic.value(value)) < ZERO_COMPONENT)

    # The answer is cached, because all branches of loops test the same lengths.
    return terms.memoize(("vanishes", value), is_zero)
