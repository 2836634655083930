"""Terms in numbers at the reference configuration, which tells the branch of a loop that is meant.

Only signs are read off these numbers, so doubles do.
"""

import cmath
import math
from collections.abc import Iterable, Mapping, Sequence

import sympy as sp

from ...terms.terms import Terms
from .phasors import Complex, PhasorSum


class AtReference:
    """Values of terms where the known coordinates have their reference values."""

    def __init__(
        self,
        terms: Terms,
        values: Mapping[sp.Symbol, float],
        given: Mapping[str, float],
        joints: Iterable[str] = (),
    ) -> None:
        """Fixes the configuration.

        Args:
            terms: Names of all terms.
            values: Reference values of the known coordinates.
            given: Joint, swing and cylinder values near the reference configuration, by name.
            joints: Names of joints that are near zero there if nothing is given.
        """
        self.terms = terms
        self.given = dict(given)
        self.assumed = dict.fromkeys(joints, 0.0)
        self._known: dict[sp.Symbol, float] = dict(values)

    def hints_of(self, names: Sequence[str]) -> dict[str, float]:
        """Values near the reference of those joints for which one is given; else those assumed."""
        for hints in (self.given, self.assumed):
            found = {name: hints[name] for name in names if name in hints}
            if found:
                return found
        return {}

    def of(self, expression: sp.Expr) -> float:
        """The value of an expression; NaN where a loop does not close."""
        symbols = expression.free_symbols
        numbers = {symbol: sp.Float(self._of_symbol(symbol)) for symbol in symbols}
        value = complex(expression.xreplace(numbers).evalf())
        return value.real if value.imag == 0 else math.nan

    def number(self, value: Complex) -> complex:
        """A complex number."""
        return complex(self.of(value[0]), self.of(value[1]))

    def vector(self, total: PhasorSum) -> complex:
        """A sum of turning vectors."""
        return sum(
            (self.number(c) * cmath.exp(1j * self.of(angle)) for angle, c in total.terms.items()),
            0j,
        )

    def turn(self, angle: sp.Expr, rotor: Complex) -> float:
        """The angle of a turn that is part exact angle, part constant rotor."""
        return self.of(angle) + cmath.phase(self.number(rotor))

    def _of_symbol(self, symbol: sp.Symbol) -> float:
        if symbol not in self._known:
            if self.terms.is_constant(symbol):
                self._known[symbol] = float(self.terms.value(symbol))
            else:
                self._known[symbol] = self.of(self.terms.definitions[symbol])
        return self._known[symbol]


def wrapped(angle: float) -> float:
    """The same angle between -pi and pi."""
    return math.remainder(angle, math.tau)
