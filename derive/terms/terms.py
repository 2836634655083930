"""Named shared terms: every intermediate result has one name, so that nothing is computed twice.

Expressions built through a :class:`Terms` stay a few symbols long, however long the chain is. Equal
terms get the same name, also up to sign, which is common subexpression elimination by construction.
"""

from collections.abc import Callable, Hashable, Iterable, Mapping
from typing import TypeVar, cast

import sympy as sp

from ..model.roots import is_short
from ..model.sizes import addends, size
from ..model.tolerances import MEANT, ROUNDING
from ..model.values import Values, to_digits

TERM = "_t"
CONSTANT = "_k"
Result = TypeVar("Result")
"""First letters of the names of terms and of constants; no name in a robot file has them."""


class Terms:
    """The terms and constants of one derivation, in the order in which they depend on each other.

    Attributes:
        parameters: The exact default value of every parameter.
        definitions: Definition of each named term in coordinates, constants and earlier terms.
        constants: Definition of each named constant in parameters and earlier constants.
        solved: Cosine and sine of each angle that is a loop's solution.
        turning: Angle of each named cosine or sine that a solution gives as a term instead of a
            function of the angle, and its derivative by the angle.
    """

    def __init__(self, parameters: Mapping[sp.Symbol, sp.Expr]) -> None:
        self.parameters = dict(parameters)
        self.definitions: dict[sp.Symbol, sp.Expr] = {}
        self.constants: dict[sp.Symbol, sp.Expr] = {}
        self.solved: dict[sp.Symbol, tuple[sp.Expr, sp.Expr]] = {}
        self.turning: dict[sp.Symbol, tuple[sp.Expr, sp.Expr]] = {}
        self._composed: dict[sp.Expr, tuple[sp.Expr, sp.Expr]] = {}
        self._names: dict[sp.Expr, sp.Expr] = {}
        self._values = Values()
        self._constant_symbols = set(self.parameters)
        self._numbers: set[sp.Symbol] = set()
        self._made: dict[Hashable, object] = {}
        self._partials: dict[tuple[sp.Expr, sp.Symbol], sp.Expr] = {}
        self._addends: dict[sp.Symbol, int] = {}
        self._sizes: dict[sp.Symbol, int] = {}
        for symbol, value in self.parameters.items():
            self._values.know(symbol, self._values.of(value))

    def let(self, expression: sp.Expr) -> sp.Expr:
        """The name of an expression or the negative of a name; fractions and symbols are unnamed.

        An expression of numbers and parameters becomes a named constant. A number that equals 0, 1
        or -1 to 32 digits becomes that integer, which shows the structure of the chain; a constant
        that depends on a parameter stays a constant. A fraction of many digits becomes a constant
        too, so that products of products do not grow.

        Raises:
            NoValue: A constant is not finite or not real.
        """
        known = self._names.get(expression)
        if known is not None:
            return known
        if is_short(expression) or expression.is_Symbol or (-expression).is_Symbol:
            return expression
        symbols = expression.free_symbols
        if symbols <= self._constant_symbols:
            return self._constant(expression, is_number=symbols <= self._numbers)
        if _negative(expression):
            return -self.let(-expression)
        opposite = self._names.get(-expression)
        if opposite is not None:
            return -opposite
        return self._name(expression)

    def partial(self, expression: sp.Expr, symbol: sp.Symbol) -> sp.Expr:
        """The named derivative of an expression by a symbol, its named terms held."""
        key = expression, symbol
        if key not in self._partials:
            parts = (_derivative(part, symbol) for part in sp.Add.make_args(expression))
            self._partials[key] = self.let(sp.Add(*parts))
        return self._partials[key]

    def once(self, key: Hashable, made: Callable[[], Result]) -> Result:
        """A result over these terms that is asked for again and again, such as a body's pose.

        Args:
            key: All that the result depends on.
            made: Makes it.
        """
        if key not in self._made:
            self._made[key] = made()
        return cast("Result", self._made[key])

    def value(self, expression: sp.Expr) -> sp.Expr:
        """The value, to 40 digits, of an expression of parameters (at defaults) and constants.

        Raises:
            NoValue: It is not finite or not real, or contains other symbols.
        """
        return to_digits(self._values.of(expression))

    def is_constant(self, expression: sp.Expr) -> bool:
        """Whether an expression contains only numbers, parameters and constants."""
        return bool(expression.free_symbols <= self._constant_symbols)

    def is_number(self, expression: sp.Expr) -> bool:
        """Whether an expression is a number that no parameter changes."""
        return bool(expression.free_symbols <= self._numbers)

    def is_never_zero(self, expression: sp.Expr) -> bool:
        """Whether an expression is a constant other than 0, at the default of every parameter."""
        return self.is_constant(expression) and self.value(expression) != 0

    def is_noise(self, expression: sp.Expr) -> bool:
        """Whether an expression is a constant other than 0 whose square counts as 0."""
        return self.is_never_zero(expression) and bool(self.value(expression) ** 2 <= ROUNDING)

    def cos_sin(self, angle: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
        """Named cosine and sine of an angle; right angles in a sum are taken out exactly.

        The cosine and sine of a sum with solved angles follow from those of its addends by the
        addition theorem, without a trigonometric function.
        """
        if not self.is_solved(angle):
            return self.let(sp.cos(angle)), self.let(sp.sin(angle))
        if angle not in self._composed:
            self._composed[angle] = self._known_sum(angle) or self._product_of_turns(
                sp.expand(angle)
            )
        return self._composed[angle]

    def solved_angle(self, c: sp.Expr, s: sp.Expr) -> sp.Expr:
        """The name of an angle whose cosine and sine are known; its value takes one atan2."""
        c, s = self.let(c), self.let(s)
        definition = sp.atan2(s, c, evaluate=False)
        angle = self._names.get(definition) or self._name(definition)
        self.solved[angle] = c, s
        self._register(angle, c, s)
        return angle

    def solved_rest(self, angle: sp.Expr, c: sp.Expr, s: sp.Expr) -> sp.Expr:
        """The name of a sum of solved angles, wrapped to one turn without an atan2.

        Args:
            angle: The sum, between -3 pi and 3 pi.
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
        """Records cosine and sine of a sum of solved angles that is solved before its addends."""
        self._composed[sp.expand(angle)] = self.let(c), self.let(s)

    def is_solved(self, angle: sp.Expr) -> bool:
        """Whether an angle contains the angle of a loop's solution."""
        return not self.solved.keys().isdisjoint(angle.free_symbols)

    def spelled(self, expression: sp.Expr) -> sp.Expr:
        """An expression with its named constants written out in numbers and parameters."""
        while not self.constants.keys().isdisjoint(expression.free_symbols):
            expression = expression.xreplace(self.constants)
        return expression

    def addends(self, expression: sp.Expr) -> int:
        """The most addends that an expression may have, spelled and expanded; at most 10000."""
        return self._counted(expression, addends, self._addends)

    def size(self, expression: sp.Expr) -> int:
        """The number of symbols and numbers in a spelled expression; at most 10000."""
        return self._counted(expression, size, self._sizes)

    def constants_in(self, expression: sp.Expr) -> list[sp.Symbol]:
        """The constants on which an expression depends, in the order of their definition."""
        return _below(self.constants, [expression])

    def needed(self, expressions: Iterable[sp.Expr]) -> list[sp.Symbol]:
        """The terms on which expressions depend, in the order of their definition."""
        return _below(self.definitions, expressions)

    def _counted(
        self,
        expression: sp.Expr,
        count: Callable[[sp.Expr, Mapping[sp.Symbol, int]], int],
        known: dict[sp.Symbol, int],
    ) -> int:
        """A count of the parts of an expression, from those of its constants."""
        if not (expression.free_symbols & self.constants.keys()) <= known.keys():
            for symbol in self.constants_in(expression):
                if symbol not in known:
                    known[symbol] = count(self.constants[symbol], known)
        return count(expression, known)

    def _known_sum(self, angle: sp.Expr) -> tuple[sp.Expr, sp.Expr] | None:
        """Cosine and sine of a sum, from a known sum that differs by a constant or a sign."""
        constant, moving = sp.expand(angle).as_independent(*self.solved, as_Add=True)
        for sign in (1, -1):
            known = self._composed.get(sign * moving)
            if known is not None and self.is_constant(constant):
                (c1, s1), (c2, s2) = self.cos_sin(constant), (known[0], sign * known[1])
                return self.let(c1 * c2 - s1 * s2), self.let(s1 * c2 + c1 * s2)
        return None

    def _product_of_turns(self, angle: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
        """exp(i (a + b)) = exp(i a) exp(i b), where b is the solved angle that was named last."""
        if angle in self.solved:
            return self.solved[angle]
        if -angle in self.solved:
            c, s = self.solved[-angle]
            return c, -s
        order = {symbol: k for k, symbol in enumerate(self.definitions)}
        last = max((s for s in angle.free_symbols if s in self.solved), key=order.__getitem__)
        factor = angle.coeff(last)
        if not factor.is_Integer:
            raise ValueError(
                f"the solved angle {last} does not enter {angle} a whole number of times"
            )
        sign = sp.sign(factor)
        c1, s1 = self.cos_sin(angle - sign * last)
        c2, s2 = self.solved[last]
        c = self.let(c1 * c2 - sign * s1 * s2)
        s = self.let(s1 * c2 + sign * c1 * s2)
        self._register(angle, c, s)
        return c, s

    def _register(self, angle: sp.Expr, c: sp.Expr, s: sp.Expr) -> None:
        """Records the derivatives of the named cosine and sine of an angle by the angle."""
        for value, derivative in ((c, -s), (s, c)):
            # The cosine of a link of length 1 may be a coordinate itself, whose rate is given.
            if value in self.definitions:
                self.turning.setdefault(value, (angle, derivative))
            elif -value in self.definitions:
                self.turning.setdefault(-value, (angle, -derivative))

    def _name(self, expression: sp.Expr) -> sp.Expr:
        symbol = sp.Symbol(f"{TERM}{len(self.definitions) + 1}", real=True)
        self.definitions[symbol] = expression
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
            self._values.know(symbol, self._values.of(positive))
            self._names[positive] = symbol
            self._constant_symbols.add(symbol)
            if is_number:
                self._numbers.add(symbol)
        return sign * self._names[positive]


def _below(
    definitions: Mapping[sp.Symbol, sp.Expr], expressions: Iterable[sp.Expr]
) -> list[sp.Symbol]:
    """The defined symbols on which expressions depend, in the order of their definition."""
    found: set[sp.Symbol] = set()
    waiting = [symbol for e in expressions for symbol in e.free_symbols]
    while waiting:
        symbol = waiting.pop()
        if symbol in definitions and symbol not in found:
            found.add(symbol)
            waiting.extend(definitions[symbol].free_symbols)
    return [symbol for symbol in definitions if symbol in found]


def _derivative(addend: sp.Expr, symbol: sp.Symbol) -> sp.Expr:
    """The derivative of an addend; products, which most are, without SymPy's general way."""
    if symbol not in addend.free_symbols:
        return sp.S.Zero
    others = [factor for factor in sp.Mul.make_args(addend) if factor != symbol]
    if any(symbol in factor.free_symbols for factor in others):
        return sp.diff(addend, symbol)
    return sp.Mul(*others)


def _negative(expression: sp.Expr) -> bool:
    if expression.is_Add:
        return all(term.as_coeff_Mul()[0].is_negative for term in expression.args)
    return bool(expression.as_coeff_Mul()[0].is_negative)
