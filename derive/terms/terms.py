"""Named shared terms. Every intermediate result has one name and is computed once.

An expression in named terms stays short, even for a long chain. Terms that are equal up to sign
share a name (common subexpression elimination by construction).
"""

from collections.abc import Callable, Collection, Hashable, Iterable, Mapping
from typing import TypeVar, cast

import sympy as sp

from ..model.roots import is_short
from ..model.sizes import addends, size
from ..model.tolerances import MEANT, ROUNDING
from ..model.values import Values, to_digits

TERM = "_t"
"""Prefix of the symbols that stand for shared terms. No name in a robot file starts with this
prefix."""
CONSTANT = "_k"
"""Prefix of the symbols that stand for constants. No name in a robot file starts with this
prefix."""
Result = TypeVar("Result")


class Terms:
    """The named terms and constants of a derivation, each after the terms in its definition.

    Attributes:
        parameters: The exact default value of every parameter.
        definitions: Definition of each named term.
        constants: Definition of each named constant.
        solved: Cosine and sine of each solved loop angle.
        turning: For each named cosine or sine of a loop solution, its angle, and its derivative
            with respect to this angle.
    """

    def __init__(self, parameters: Mapping[sp.Symbol, sp.Expr]) -> None:
        self.parameters = dict(parameters)
        self.definitions: dict[sp.Symbol, sp.Expr] = {}
        self.constants: dict[sp.Symbol, sp.Expr] = {}
        self.solved: dict[sp.Symbol, tuple[sp.Expr, sp.Expr]] = {}
        self.turning: dict[sp.Symbol, tuple[sp.Expr, sp.Expr]] = {}
        self._composed: dict[sp.Expr, tuple[sp.Expr, sp.Expr]] = {}
        self._names: dict[sp.Expr, sp.Expr] = {}
        self._mixed: dict[frozenset[tuple[sp.Expr, sp.Expr]], sp.Expr] = {}
        self._values = Values()
        self._decimals: dict[sp.Expr, sp.Expr] = {}
        self._constant_symbols = set(self.parameters)
        self._numbers: set[sp.Symbol] = set()
        self._made: dict[Hashable, object] = {}
        self._partials: dict[tuple[sp.Expr, sp.Symbol], sp.Expr] = {}
        self._addends: dict[sp.Symbol, int] = {}
        self._sizes: dict[sp.Symbol, int] = {}
        self._positions: dict[sp.Symbol, int] = {}
        self._symbols: dict[sp.Symbol, frozenset[sp.Symbol]] = {}
        for symbol, value in self.parameters.items():
            self._values.know(symbol, self._values.of(value))

    def let(self, expression: sp.Expr) -> sp.Expr:
        """Return the symbol of an expression, or minus the symbol of the negated expression.

        Symbols and short fractions get no name.

        An expression of numbers and parameters becomes a named constant. A number that equals 0, 1
        or -1 to 32 digits becomes this integer, so that more terms vanish. A constant that depends
        on a parameter never becomes a number. A long fraction becomes a named constant.

        Raises:
            NoValue: A constant is not finite or not real.
        """
        known = self._names.get(expression)
        if known is not None:
            return known
        if is_short(expression) or _is_signed_symbol(expression):
            return expression
        if self.is_constant(expression):
            return self._constant(expression, is_number=self.is_number(expression))
        parts = [addend.as_coeff_Mul() for addend in sp.Add.make_args(expression)]
        negative = [factor.is_negative for factor, _ in parts]
        if all(negative):
            return -self.let(-expression)
        if not any(negative):
            return self._name(expression)
        # The negated sum may already have a name that can be reused. Because SymPy takes long to
        # negate a sum, only sums with both positive and negative summands are looked up.
        opposite = self._mixed.get(frozenset((-factor, rest) for factor, rest in parts))
        if opposite is not None:
            return -opposite
        return self._mixed.setdefault(frozenset(parts), self._name(expression))

    def partial(self, expression: sp.Expr, symbol: sp.Symbol) -> sp.Expr:
        """Return the partial derivative of an expression with respect to a symbol.

        Other named terms count as constants.
        """
        key = expression, symbol
        if key not in self._partials:
            self._partials[key] = self.let(derivative(expression, symbol))
        return self._partials[key]

    def memoize(self, key: Hashable, made: Callable[[], Result]) -> Result:
        """Store a result that is needed repeatedly, such as a pose.

        Args:
            key: Key of the stored result. The key contains all values that determine the result.
            made: Computes the result.
        """
        if key not in self._made:
            self._made[key] = made()
        return cast("Result", self._made[key])

    def value(self, expression: sp.Expr) -> sp.Expr:
        """Return the value of an expression with 40 digits. Parameters have their default values.

        Raises:
            NoValue: The value of the expression is not finite or not real, or the expression
                contains coordinates.
        """
        known = self._decimals.get(expression)
        if known is None:
            known = self._decimals[expression] = to_digits(self._values.of(expression))
        return known

    def is_constant(self, expression: sp.Expr) -> bool:
        """Whether an expression contains only numbers, parameters and constants."""
        return _has_only(expression, self._constant_symbols)

    def is_number(self, expression: sp.Expr) -> bool:
        """Whether an expression is a number and contains no parameter."""
        return _has_only(expression, self._numbers)

    def is_never_zero(self, expression: sp.Expr) -> bool:
        """Whether an expression is a constant that differs from zero at the default parameters."""
        return self.is_constant(expression) and self.value(expression) != 0

    def is_noise(self, expression: sp.Expr) -> bool:
        """Whether an expression is a tiny constant whose square counts as 0."""
        return self.is_never_zero(expression) and bool(self.value(expression) ** 2 <= ROUNDING)

    def cos_sin(self, angle: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
        """Return the names of the cosine and sine of an angle.

        If the angle is a sum that contains solved angles, the addition theorems give its cosine and
        sine.
        """
        if not self.is_solved(angle):
            return self.let(sp.cos(angle)), self.let(sp.sin(angle))
        if angle not in self._composed:
            self._composed[angle] = self._known_sum(angle) or self._product_of_turns(
                sp.expand(angle)
            )
        return self._composed[angle]

    def solved_angle(self, c: sp.Expr, s: sp.Expr) -> sp.Expr:
        """Return the symbol of an angle with known cosine and sine.

        One atan2 computes the angle.
        """
        c, s = self.let(c), self.let(s)
        definition = sp.atan2(s, c, evaluate=False)
        angle = self._names.get(definition) or self._name(definition)
        self.solved[angle] = c, s
        self._register(angle, c, s)
        return angle

    def solved_rest(self, angle: sp.Expr, c: sp.Expr, s: sp.Expr) -> sp.Expr:
        """Return the name of a sum of solved angles.

        The sum is reduced to one full turn without atan2.

        Args:
            angle: The sum of solved angles, between -3 pi and 3 pi.
            c: Cosine of the sum.
            s: Sine of the sum.
        """
        angle = self.let(angle)
        turns = ((angle - 2 * sp.pi, angle > sp.pi), (angle + 2 * sp.pi, angle < -sp.pi))
        name = self.let(sp.Piecewise(*turns, (angle, True)))
        self.solved[name] = c, s
        self._register(name, c, s)
        return name

    def know_sum(self, angle: sp.Expr, c: sp.Expr, s: sp.Expr) -> None:
        """Record the cosine and sine of a sum of angles.

        Use this method if the sum is known before the individual angles.
        """
        self._composed[sp.expand(angle)] = self.let(c), self.let(s)

    def is_solved(self, angle: sp.Expr) -> bool:
        """Whether an angle contains a solved loop angle."""
        return not self.solved.keys().isdisjoint(angle.free_symbols)

    def spelled(self, expression: sp.Expr) -> sp.Expr:
        """Replace named constants by their definitions."""
        while not self.constants.keys().isdisjoint(expression.free_symbols):
            expression = expression.xreplace(self.constants)
        return expression

    def addends(self, expression: sp.Expr) -> int:
        """Return an upper bound of the number of terms after full expansion, at most 10000."""
        return self._counted(expression, addends, self._addends)

    def size(self, expression: sp.Expr) -> int:
        """Return the number of symbols and numbers in an expression, at most 10000.

        Named constants are expanded.
        """
        return self._counted(expression, size, self._sizes)

    def constants_in(self, expression: sp.Expr) -> list[sp.Symbol]:
        """Return all constants on which an expression depends, in order of their definition."""
        return self._below(self.constants, [expression])

    def needed(self, expressions: Iterable[sp.Expr]) -> list[sp.Symbol]:
        """Return all terms on which expressions depend, in order of their definition."""
        return self._below(self.definitions, expressions)

    def _counted(
        self,
        expression: sp.Expr,
        count: Callable[[sp.Expr, Mapping[sp.Symbol, int]], int],
        known: dict[sp.Symbol, int],
    ) -> int:
        if not (expression.free_symbols & self.constants.keys()) <= known.keys():
            for symbol in self.constants_in(expression):
                if symbol not in known:
                    known[symbol] = count(self.constants[symbol], known)
        return count(expression, known)

    def _known_sum(self, angle: sp.Expr) -> tuple[sp.Expr, sp.Expr] | None:
        constant, moving = sp.expand(angle).as_independent(*self.solved, as_Add=True)
        for sign in (1, -1):
            known = self._composed.get(sign * moving)
            if known is not None and self.is_constant(constant):
                (c1, s1), (c2, s2) = self.cos_sin(constant), (known[0], sign * known[1])
                return self.let(c1 * c2 - s1 * s2), self.let(s1 * c2 + c1 * s2)
        return None

    def _product_of_turns(self, angle: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
        if angle in self.solved:
            return self.solved[angle]
        if -angle in self.solved:
            c, s = self.solved[-angle]
            return c, -s
        order = {symbol: k for k, symbol in enumerate(self.definitions)}
        last = max((s for s in angle.free_symbols if s in self.solved), key=order.__getitem__)
        factor = angle.coeff(last)
        if not factor.is_Integer:
            # The angle sum formulas need integer multiples of an angle, but gear ratios may be
            # fractions.
            name = self.let(angle)
            return self.let(sp.cos(name)), self.let(sp.sin(name))
        sign = sp.sign(factor)
        c1, s1 = self.cos_sin(angle - sign * last)
        c2, s2 = self.solved[last]
        c = self.let(c1 * c2 - sign * s1 * s2)
        s = self.let(s1 * c2 + sign * c1 * s2)
        self._register(angle, c, s)
        return c, s

    def _register(self, angle: sp.Expr, c: sp.Expr, s: sp.Expr) -> None:
        for value, derivative in ((c, -s), (s, c)):
            # If a link has length 1, the cosine of an angle may equal a coordinate, whose rate is
            # an input.
            if value in self.definitions:
                self.turning.setdefault(value, (angle, derivative))
            elif -value in self.definitions:
                self.turning.setdefault(-value, (angle, -derivative))

    def _below(
        self, definitions: Mapping[sp.Symbol, sp.Expr], expressions: Iterable[sp.Expr]
    ) -> list[sp.Symbol]:
        found: set[sp.Symbol] = set()
        waiting = {symbol for e in expressions for symbol in e.free_symbols}
        while waiting:
            symbol = waiting.pop()
            if symbol not in definitions:
                continue
            found.add(symbol)
            if symbol not in self._symbols:
                self._symbols[symbol] = frozenset(definitions[symbol].free_symbols)
            waiting |= self._symbols[symbol] - found
        return sorted(found, key=self._positions.__getitem__)

    def _name(self, expression: sp.Expr) -> sp.Expr:
        symbol = sp.Symbol(f"{TERM}{len(self.definitions) + 1}", real=True)
        self.definitions[symbol] = expression
        self._positions[symbol] = len(self._positions)
        self._names[expression] = symbol
        return symbol

    def _constant(self, expression: sp.Expr, *, is_number: bool) -> sp.Expr:
        value = self._values.of(expression)
        if is_number:
            for integer in (0, 1, -1):
                if abs(value - integer) < ROUNDING and not 0 < abs(value) < MEANT:
                    return sp.Integer(integer)
        sign, positive = (-1, -expression) if value < 0 else (1, expression)
        if positive not in self._names:
            symbol = sp.Symbol(f"{CONSTANT}{len(self.constants) + 1}", real=True)
            self.constants[symbol] = positive
            self._positions[symbol] = len(self._positions)
            self._values.know(symbol, self._values.of(positive))
            self._names[positive] = symbol
            self._constant_symbols.add(symbol)
            if is_number:
                self._numbers.add(symbol)
        return sign * self._names[positive]


def derivative(expression: sp.Expr, symbol: sp.Symbol) -> sp.Expr:
    """Return the derivative of an expression, faster than SymPy for sums and products."""
    return sp.Add(*(_of_product(addend, symbol) for addend in sp.Add.make_args(expression)))


def _of_product(product: sp.Expr, symbol: sp.Symbol) -> sp.Expr:
    if symbol not in product.free_symbols:
        return sp.S.Zero
    factors = sp.Mul.make_args(product)
    parts = []
    for k, factor in enumerate(factors):
        if symbol in factor.free_symbols:
            rate = sp.S.One if factor == symbol else sp.diff(factor, symbol)
            parts.append(sp.Mul(*factors[:k], rate, *factors[k + 1 :]))
    return sp.Add(*parts)


def _is_signed_symbol(expression: sp.Expr) -> bool:
    if expression.is_Mul and len(expression.args) == 2:  # noqa: PLR2004
        sign, expression = expression.args
        return sign is sp.S.NegativeOne and bool(expression.is_Symbol)
    return bool(expression.is_Symbol)


def _has_only(expression: sp.Basic, symbols: Collection[sp.Symbol]) -> bool:
    if expression.is_Symbol:
        return expression in symbols
    return all(_has_only(argument, symbols) for argument in expression.args)
