"""Computes roots and angles of numbers.

Results are exact for short numbers (fractions of integers up to ``LONGEST_EXACT``), and decimal for
long numbers.

A long number is already rounded, so an exact root would be no more accurate than a decimal root.
For an exact root, SymPy would also factor the number, which may take long or fail.
"""

from collections.abc import Mapping

import sympy as sp

from .tolerances import WORKING_DIGITS
from .values import Values

LONGEST_EXACT = 10**15
"""Maximum numerator and denominator of a fraction that counts as exact.

SymPy can factor integers of this size, which simplifies square roots.
"""


def is_short(expression: sp.Expr) -> bool:
    """Whether an expression is a fraction of integers up to ``LONGEST_EXACT``."""
    return bool(expression.is_Rational and max(abs(expression.p), expression.q) <= LONGEST_EXACT)


def power(base: sp.Expr, exponent: sp.Expr) -> sp.Expr:
    """Return a power with a rational exponent.

    Raises:
        NoValue: The base is a negative number without a short exact form, and the power is not
            real.
    """
    result_is_exact = exponent.is_Integer or base.free_symbols or _has_short_numbers(base)
    return base**exponent if result_is_exact else _decimal(sp.Pow(base, exponent, evaluate=False))


def root(square: sp.Expr) -> sp.Expr:
    """Return the square root of an expression."""
    return power(square, sp.Rational(1, 2))


def drawn_out(expression: sp.Expr) -> sp.Expr:
    """Take square factors out of roots: sqrt(4 a + 4 b) becomes 2 sqrt(a + b)."""
    return expression.replace(_is_root_of_sum, _drawn_out)


def _is_root_of_sum(part: sp.Expr) -> bool:
    return bool(part.is_Pow and part.base.is_Add and part.exp == sp.Rational(1, 2))


def _drawn_out(whole: sp.Expr) -> sp.Expr:
    content, primitive = whole.base.primitive()
    outside = root(content)
    return outside * sp.sqrt(primitive) if outside.is_Rational else whole


def angle_of(y: sp.Expr, x: sp.Expr) -> sp.Expr:
    """Return atan2(y, x).

    The result is a decimal if y^2 or x^2 contains numbers with many digits.

    The result is also a decimal if exact evaluation would be slow or would return a complex
    logarithm.
    """
    angle = sp.atan2(y, x, evaluate=False)
    if y.free_symbols | x.free_symbols or y == 0 or x == 0:
        return sp.atan2(y, x)
    if angle.has(sp.sin, sp.cos, sp.tan) or not all(_has_short_numbers(p**2) for p in (y, x)):
        return _decimal(angle)
    exact = sp.atan2(y, x)
    return _decimal(angle) if exact.has(sp.I) else exact


def at(expression: sp.Expr, numbers: Mapping[sp.Symbol, sp.Expr]) -> sp.Expr:
    """Replace symbols by numbers.

    Roots are computed by ``power``, and angles by ``angle_of``.

    Raises:
        NoValue: The base of a root is a negative number.
    """
    if expression.is_Symbol:
        return numbers.get(expression, expression)
    parts = [at(part, numbers) for part in expression.args]
    if expression.is_Pow:
        return power(*parts)
    if isinstance(expression, sp.atan2 | sp.atan):
        return angle_of(parts[0], parts[1] if len(parts) > 1 else sp.S.One)
    return expression.func(*parts) if parts else expression


def _has_short_numbers(expression: sp.Expr) -> bool:
    return all(map(is_short, expression.atoms(sp.Rational)))


def _decimal(expression: sp.Expr) -> sp.Expr:
    return sp.Rational(sp.Float(Values().of(expression), WORKING_DIGITS))
