"""Named shared terms: every intermediate result gets a name once, so that nothing is written twice.

Expressions built through a :class:`Terms` stay a few symbols long, however long the chain is. Equal
terms get the same name, also up to sign, which is common subexpression elimination by construction.
"""

from collections.abc import Iterable, Mapping

import sympy as sp

from ..model.tolerances import EVALUATION_DIGITS, MEANT, ROUNDING

TERM = "_t"
CONSTANT = "_k"
"""Names of terms and constants begin so; names in robot files can not begin with an underscore."""


class Terms:
    """The terms and constants of one derivation, in the order in which they depend on each other.

    Attributes:
        parameters: The exact default value of every parameter.
        definitions: Definition of each named term in symbols before it.
        constants: Definition of each named constant in parameters and constants before it.
        solved: Cosine and sine of each angle that the solution of a loop gives.
        turning: For each named cosine or sine that is not a function of its angle but a term of a
            solution: the angle, and the derivative by it.
    """

    def __init__(self, parameters: Mapping[sp.Symbol, sp.Expr]) -> None:
        self.parameters = dict(parameters)
        self.definitions: dict[sp.Symbol, sp.Expr] = {}
        self.constants: dict[sp.Symbol, sp.Expr] = {}
        self.solved: dict[sp.Symbol, tuple[sp.Expr, sp.Expr]] = {}
        self.turning: dict[sp.Symbol, tuple[sp.Expr, sp.Expr]] = {}
        self._composed: dict[sp.Expr, tuple[sp.Expr, sp.Expr]] = {}
        self._names: dict[sp.Expr, sp.Expr] = {}
        self._values: dict[sp.Symbol, sp.Expr] = {
            symbol: value.evalf(EVALUATION_DIGITS) for symbol, value in self.parameters.items()
        }
        self._numbers: set[sp.Symbol] = set()

    def let(self, expression: sp.Expr) -> sp.Expr:
        """The name of an expression, or its negative; fractions and lone symbols name themselves.

        An expression of numbers and parameters becomes a named constant. A number that is 0, 1 or
        -1 to 32 digits becomes that integer, so that structure shows; one that depends on a
        parameter is never judged so.
        """
        known = self._names.get(expression)
        if known is not None:
            return known
        if expression.is_Rational or expression.is_Symbol or (-expression).is_Symbol:
            return expression
        if self.is_constant(expression):
            return self._constant(expression)
        if _negative(expression):
            return -self.let(-expression)
        opposite = self._names.get(-expression)
        if opposite is not None:
            return -opposite
        return self._name(expression)

    def value(self, expression: sp.Expr) -> sp.Expr:
        """The number, to 40 digits, of an expression of parameters and constants at defaults."""
        exact = expression.xreplace(self.parameters)
        return exact.xreplace(self._values).evalf(EVALUATION_DIGITS)

    def is_constant(self, expression: sp.Expr) -> bool:
        """Whether an expression holds numbers, parameters and constants alone."""
        return bool(expression.free_symbols <= self._values.keys())

    def is_number(self, expression: sp.Expr) -> bool:
        """Whether an expression is a number whatever the parameters are."""
        return bool(expression.free_symbols <= self._numbers)

    def cos_sin(self, angle: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
        """Named cosine and sine of an angle; right angles in a sum are taken out exactly.

        Those of a sum with solved angles come from theirs, without a trigonometric function.
        """
        if not self.is_solved(angle):
            return self.let(sp.cos(angle)), self.let(sp.sin(angle))
        if angle not in self._composed:
            self._composed[angle] = self._known_sum(angle) or self._product_of_turns(
                sp.expand(angle)
            )
        return self._composed[angle]

    def solved_angle(self, c: sp.Expr, s: sp.Expr) -> sp.Expr:
        """The name of an angle whose cosine and sine are known; its value costs an atan2."""
        c, s = self.let(c), self.let(s)
        definition = sp.atan2(s, c, evaluate=False)
        angle = self._names.get(definition) or self._name(definition)
        self.solved[angle] = c, s
        self._register(angle, c, s)
        return angle

    def solved_rest(self, angle: sp.Expr, c: sp.Expr, s: sp.Expr) -> sp.Expr:
        """The name of an angle that is a sum of solved ones, wrapped; its value costs no atan2.

        Args:
            angle: The sum, between -3 pi and 3 pi.
            c: Its cosine.
            s: Its sine.
        """
        angle = self.let(angle)
        turns = ((angle - 2 * sp.pi, angle > sp.pi), (angle + 2 * sp.pi, angle < -sp.pi))
        name = self.let(sp.Piecewise(*turns, (angle, True)))
        self.solved[name] = c, s
        self._register(name, c, s)
        return name

    def know_sum(self, angle: sp.Expr, c: sp.Expr, s: sp.Expr) -> None:
        """Notes cosine and sine of a sum of solved angles that was found before its parts."""
        self._composed[sp.expand(angle)] = self.let(c), self.let(s)

    def is_solved(self, angle: sp.Expr) -> bool:
        """Whether an angle contains one that a loop's solution gives."""
        return not self.solved.keys().isdisjoint(angle.free_symbols)

    def spelled(self, expression: sp.Expr) -> sp.Expr:
        """An expression with its named constants written out in numbers and parameters."""
        while not self.constants.keys().isdisjoint(expression.free_symbols):
            expression = expression.xreplace(self.constants)
        return expression

    def needed(self, expressions: Iterable[sp.Expr]) -> list[sp.Symbol]:
        """The terms that expressions rest on, in the order of their definition."""
        found: set[sp.Symbol] = set()
        waiting = [symbol for e in expressions for symbol in e.free_symbols]
        while waiting:
            symbol = waiting.pop()
            if symbol in self.definitions and symbol not in found:
                found.add(symbol)
                waiting.extend(self.definitions[symbol].free_symbols)
        return [symbol for symbol in self.definitions if symbol in found]

    def _known_sum(self, angle: sp.Expr) -> tuple[sp.Expr, sp.Expr] | None:
        """From the known cosine and sine of the same sum, but for a constant or its sign."""
        constant, moving = sp.expand(angle).as_independent(*self.solved, as_Add=True)
        for sign in (1, -1):
            known = self._composed.get(sign * moving)
            if known is not None and self.is_constant(constant):
                (c1, s1), (c2, s2) = self.cos_sin(constant), (known[0], sign * known[1])
                return self.let(c1 * c2 - s1 * s2), self.let(s1 * c2 + c1 * s2)
        return None

    def _product_of_turns(self, angle: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
        """exp(i (a + b)) = exp(i a) exp(i b), the solved angle that was named last split off."""
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
        """Notes what the named cosine and sine of an angle become when it turns."""
        for value, derivative in ((c, -s), (s, c)):
            # A coordinate may be a cosine, of a link of length 1; it moves as it is told to.
            if value in self.definitions:
                self.turning.setdefault(value, (angle, derivative))
            elif -value in self.definitions:
                self.turning.setdefault(-value, (angle, -derivative))

    def _name(self, expression: sp.Expr) -> sp.Expr:
        symbol = sp.Symbol(f"{TERM}{len(self.definitions) + 1}", real=True)
        self.definitions[symbol] = expression
        self._names[expression] = symbol
        return symbol

    def _constant(self, expression: sp.Expr) -> sp.Expr:
        value = self.value(expression)
        is_number = self.is_number(expression)
        if is_number:
            for integer in (0, 1, -1):
                if abs(value - integer) < ROUNDING and not 0 < abs(value) < MEANT:
                    return sp.Integer(integer)
        if value < 0:
            return -self.let(-expression)
        symbol = sp.Symbol(f"{CONSTANT}{len(self.constants) + 1}", real=True)
        self.constants[symbol] = expression
        self._values[symbol] = value
        self._names[expression] = symbol
        if is_number:
            self._numbers.add(symbol)
        return symbol


def _negative(expression: sp.Expr) -> bool:
    if expression.is_Add:
        return all(term.as_coeff_Mul()[0].is_negative for term in expression.args)
    return bool(expression.as_coeff_Mul()[0].is_negative)
