"""Values of constant expressions with 60 digits, evaluated operation by operation.

SymPy's own evaluation increases the precision until a difference has nonzero digits, which is slow
if the difference is exactly zero. In this module, a sum is zero if cancellation removes nearly all
digits.
"""

from collections.abc import Callable, Mapping

import mpmath
import sympy as sp
from sympy.core.relational import Relational
from sympy.logic.boolalg import Boolean

from .errors import DescriptionError
from .tolerances import EVALUATION_DIGITS, ROUNDING, WORKING_DIGITS

MAX_OPERATIONS = 30
"""A constant expression with more operations than this number gets a name."""


class NoValue(DescriptionError):
    """Error for an expression without a finite real value, for example a division by zero."""


class Values:
    """The values of symbols, with a cache of evaluated expressions.

    Zeros are exact.
    """

    def __init__(self) -> None:
        """Create an evaluator in which no symbol has a value yet."""
        self._known: dict[sp.Basic, mpmath.mpf] = {}

    def know(self, symbol: sp.Symbol, value: mpmath.mpf) -> None:
        """Assign a value to a symbol."""
        self._known[symbol] = value

    def of(self, expression: sp.Expr) -> mpmath.mpf:
        """Return the value of an expression of numbers and known symbols.

        Raises:
            NoValue: The value is not finite or not real, or a symbol is unknown.
        """
        with mpmath.workdps(WORKING_DIGITS):
            return self._of(expression)

    def _of(self, expression: sp.Basic) -> mpmath.mpf:
        known = self._known.get(expression)
        if known is None:
            known = self._known[expression] = self._computed(expression)
        return known

    def _computed(self, expression: sp.Basic) -> mpmath.mpf:
        if expression.is_Rational:
            return mpmath.mpf(expression.p) / expression.q
        if expression.is_Float:
            return mpmath.mp.make_mpf(expression._mpf_)
        if expression is sp.pi:
            return +mpmath.pi
        if expression.is_Add:
            return _sum([self._of(addend) for addend in expression.args])
        if expression.is_Mul:
            return mpmath.fprod([self._of(factor) for factor in expression.args])
        if expression.is_Pow:
            return _power(self._of(expression.base), expression.exp)
        if expression.is_Piecewise:
            return self._choice(expression)
        rule = _FUNCTIONS.get(expression.func)
        if rule is None:
            raise NoValue(f"{expression} has no value")
        return rule(*(self._of(argument) for argument in expression.args))

    def _choice(self, expression: sp.Piecewise) -> mpmath.mpf:
        """Return the value for the first condition that holds.

        Conditions after the first true condition may be undefined, because they are not evaluated.
        """
        for value, condition in expression.args:
            if self._holds(condition):
                return self._of(value)
        raise NoValue(f"no value, because no condition holds: {expression}")

    def _holds(self, condition: Boolean) -> bool:
        if condition in (sp.true, sp.false):
            return bool(condition)
        if isinstance(condition, Relational):
            left, right = (self._of(side) for side in condition.args)
            return bool(condition.func(_sign(_sum([left, -right])), 0))
        parts = [self._holds(part) for part in condition.args]
        return bool(condition.func(*parts))


def value_at(expression: sp.Expr, numbers: Mapping[sp.Symbol, sp.Expr]) -> mpmath.mpf:
    """Return the value of an expression if its symbols have the given values.

    Raises:
        NoValue: The value is not finite or not real, or a symbol is unknown.
    """
    values = Values()
    for symbol, number in numbers.items():
        values.know(symbol, values.of(number))
    return values.of(expression)


def shortened(expression: sp.Expr) -> sp.Expr:
    """Convert a constant expression with many operations to a 40-digit decimal.

    Args:
        expression: Any expression. An expression with symbols is returned unchanged.
    """
    if expression.free_symbols or int(sp.count_ops(expression)) <= MAX_OPERATIONS:
        return expression
    return to_digits(Values().of(expression))


def to_digits(value: mpmath.mpf) -> sp.Expr:
    """Convert a value to a SymPy number with 40 digits. Zero becomes the integer 0."""
    return sp.Float(value, EVALUATION_DIGITS) if value else sp.Integer(0)


def _sum(addends: list[mpmath.mpf]) -> mpmath.mpf:
    total = mpmath.fsum(addends)
    largest = max(abs(addend) for addend in addends)
    return total if abs(total) > ROUNDING * largest else mpmath.mpf(0)


def _power(base: mpmath.mpf, exponent: sp.Expr) -> mpmath.mpf:
    if not exponent.is_Rational:
        raise NoValue(f"no value for a power with the exponent {exponent}")
    if base == 0 and exponent.is_negative:
        raise NoValue("division by zero")
    if base < 0 and not exponent.is_Integer:
        raise NoValue("a root of a negative number")
    if exponent.is_Integer:
        return base ** int(exponent)
    return mpmath.root(base, exponent.q) ** exponent.p


def _sine(angle: mpmath.mpf) -> mpmath.mpf:
    sine = mpmath.sin(angle)
    return sine if abs(sine) > ROUNDING * abs(angle) else mpmath.mpf(0)


def _cosine(angle: mpmath.mpf) -> mpmath.mpf:
    cosine = mpmath.cos(angle)
    return cosine if abs(cosine) > ROUNDING else mpmath.mpf(0)


def _tangent(angle: mpmath.mpf) -> mpmath.mpf:
    return _sine(angle) * _power(_cosine(angle), sp.Integer(-1))


def _sign(value: mpmath.mpf) -> mpmath.mpf:
    return mpmath.mpf(mpmath.sign(value))


def _least(*values: mpmath.mpf) -> mpmath.mpf:
    return min(values)


def _greatest(*values: mpmath.mpf) -> mpmath.mpf:
    return max(values)


_FUNCTIONS: dict[type[sp.Basic], Callable[..., mpmath.mpf]] = {
    sp.sin: _sine,
    sp.cos: _cosine,
    sp.tan: _tangent,
    sp.atan: mpmath.atan,
    sp.atan2: mpmath.atan2,
    sp.Abs: abs,
    sp.sign: _sign,
    sp.Min: _least,
    sp.Max: _greatest,
}
