"""Numerical values of terms at the reference configuration.

The values of terms at the reference determine the branch signs.

Double precision is sufficient to compute branch signs.
"""

import cmath
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import TypeVar

import mpmath
import sympy as sp

from ...model.values import NoValue, Values
from ...terms.terms import Terms
from ..model.phasors import Complex, PhasorSum

Joined = tuple[str, ...]
"""Names of the joints or struts of a solution step."""
Solved = TypeVar("Solved")


class Branch:
    """Branch signs.

    Attributes:
        requested: Requested signs of the first steps with two branches: 1 for the sign at the
            reference, -1 for the opposite sign.
        own: The branch sign of each step at the reference, keyed by the joints or struts of the
            step.
        taken: The signs of the steps that are already solved: 1 for the sign at the reference, -1
            for the opposite sign.
    """

    def __init__(
        self, requested: Sequence[int] = (), own: Mapping[Joined, int] | None = None
    ) -> None:
        self.requested, self.own = tuple(requested), own or {}
        self.taken: list[int] = []

    def others_since(self, taken: int) -> "list[Branch]":
        """Return a new branch for each solved step k >= ``taken`` that has no requested sign.

        The new branch for step k keeps the signs of the earlier steps, and has the sign -1 at step
        k.
        """
        found = []
        for k in range(max(taken, len(self.requested)), len(self.taken)):
            other = Branch((*self.taken[:k], -1), self.own)
            other.taken = self.taken[:taken]
            found.append(other)
        return found

    def side(self, joined: Joined) -> sp.Expr:
        """Record and return the branch sign of the next solution step."""
        k = len(self.taken)
        self.taken.append(self.requested[k] if k < len(self.requested) else 1)
        return self.taken[-1] * self.own.get(joined, 1)

    def length(self, joined: Joined) -> sp.Expr:
        """Return the branch sign of the next step, which is the sign of a leg length."""
        return self.side(joined)

    def figure(self, joined: Joined) -> int:
        """Return the mode of the next parallelogram: 1 for parallel sides, -1 for crossed sides."""
        return int(self.side(joined))


class FreeSides(Branch):
    """Branch signs as symbols. Each step with two branches has a sign symbol.

    A parallelogram has no sign symbol and keeps its assembly mode at the reference, because its two
    modes differ in more than a sign. The length of a leg always has the same sign as at the
    reference, because an inverted leg is not a solution.
    """

    def __init__(
        self, own: Mapping[Joined, int], reference: "AtReference", sign: Callable[[], sp.Expr]
    ) -> None:
        super().__init__((), own)
        self._reference, self._sign = reference, sign

    def side(self, joined: Joined) -> sp.Expr:
        """Return the branch sign of the next step: the sign at the reference times a symbol."""
        symbol = self._sign()
        if symbol.is_Symbol:
            self._reference.know(symbol, 1.0)
        return symbol * self.own.get(joined, 1)

    def length(self, joined: Joined) -> sp.Expr:
        """Return the sign of a leg length at the reference configuration."""
        return sp.Integer(self.own.get(joined, 1))

    def figure(self, joined: Joined) -> int:
        """Return the assembly mode of a parallelogram at the reference configuration."""
        return self.own.get(joined, 1)


def every_branch(solve: Callable[[Branch], Solved], own: Mapping[Joined, int]) -> Iterator[Solved]:
    """Solve the loops on all branches, and yield the results, beginning with the reference branch.

    The branches are ordered so that the sign of the last solution step varies fastest. The
    existence of a solution step may depend on the signs of earlier steps.

    Args:
        solve: Function that solves the loops on a branch.
        own: The branch signs at the reference.
    """
    waiting: list[tuple[int, ...]] = [()]
    while waiting:
        branch = Branch(waiting.pop(), own)
        yield solve(branch)
        taken = tuple(branch.taken)
        waiting += [(*taken[:k], -1) for k in range(len(branch.requested), len(taken))]


class AtReference:
    """The reference configuration, with the numerical values of terms.

    Attributes:
        size: The longest length of the mechanism (meter), by which lengths are divided.
        sides: The branch sign of each step with two branches, keyed by the joints or struts of the
            step.
    """

    def __init__(
        self,
        terms: Terms,
        values: Mapping[sp.Symbol, float],
        given: Mapping[str, float],
        joints: Iterable[str] = (),
        size: float = 1.0,
    ) -> None:
        """Set the configuration.

        Args:
            terms: Receives the terms.
            values: Reference values of the known coordinates.
            given: Values of joints, swing angles and cylinders near the reference, by name.
            joints: Names of joints whose value is 0 by default.
            size: The longest length of the mechanism (meter).
        """
        self.size = size
        self.sides: dict[Joined, int] = {}
        self.terms = terms
        self.given = dict(given)
        self.assumed = dict.fromkeys(joints, 0.0)
        self._known: dict[sp.Symbol, float] = dict(values)
        self._values: dict[sp.Expr, float] = {}
        self._parts = Values()

    def know(self, symbol: sp.Symbol, value: float) -> None:
        """Record the value of a symbol."""
        self._known[symbol] = value
        self._values.clear()
        self._parts = Values()

    def hints_of(self, names: Sequence[str]) -> dict[str, float]:
        """Return joint values near the reference configuration, keyed by joint name.

        If at least one of the joints has a given value, the function returns only given values. If
        no joint has a given value, the function returns default values.
        """
        for hints in (self.given, self.assumed):
            found = {name: hints[name] for name in names if name in hints}
            if found:
                return found
        return {}

    def of(self, expression: sp.Expr) -> float:
        """Return the value of an expression at the reference, or NaN if a loop does not close."""
        if expression not in self._values:
            self._values[expression] = self._evaluated(expression)
        return self._values[expression]

    def _evaluated(self, expression: sp.Expr) -> float:
        numbers = {symbol: self._of_symbol(symbol) for symbol in expression.free_symbols}
        if any(map(math.isnan, numbers.values())):
            return math.nan
        for symbol, number in numbers.items():
            self._parts.know(symbol, mpmath.mpf(number))
        try:
            return float(self._parts.of(expression))
        except NoValue:
            # The expression contains the root of a negative number. SymPy can evaluate complex
            # roots, but far more slowly than ``Values``.
            value = complex(expression.xreplace(numbers).evalf())
            return value.real if value.imag == 0 else math.nan

    def number(self, value: Complex) -> complex:
        """Return the value of a symbolic complex number at the reference."""
        return complex(self.of(value[0]), self.of(value[1]))

    def vector(self, total: PhasorSum) -> complex:
        """Return the value of a sum of rotated vectors at the reference, as a complex number."""
        return sum(
            (self.number(c) * cmath.exp(1j * self.of(angle)) for angle, c in total.terms.items()),
            0j,
        )

    def turn(self, angle: sp.Expr, rotor: Complex) -> float:
        """Return an angle at the reference plus the angle of the constant rotation `rotor`."""
        return self.of(angle) + cmath.phase(self.number(rotor))

    def _of_symbol(self, symbol: sp.Symbol) -> float:
        if symbol not in self._known:
            if self.terms.is_constant(symbol):
                self._known[symbol] = float(self.terms.value(symbol))
            else:
                self._known[symbol] = self.of(self.terms.definitions[symbol])
        return self._known[symbol]


def wrapped(angle: float) -> float:
    """Wrap an angle into the interval from -pi to pi."""
    return math.remainder(angle, math.tau)
